"use strict";
(() => {
  const figure = JSON.parse(document.getElementById("draft-figures").textContent).robots;
  const panel = document.getElementById("plot-robots");
  const KINDS = { f4: Float32Array, i2: Int16Array, i1: Int8Array, u1: Uint8Array };
  const unpack = ({ dtype, bdata }) =>
    new KINDS[dtype](Uint8Array.from(atob(bdata), (c) => c.charCodeAt(0)).buffer);
  const lamp = [0.55, -0.35, 0.76].map((x) => x / Math.hypot(0.55, -0.35, 0.76));
  const robots = figure.walk.map((robot) => ({
    ...robot,
    positions: unpack(robot.positions),
    quaternions: unpack(robot.quaternions),
    travel: unpack(robot.travel),
    pose: new Float64Array(12 * robot.bodies),
    meshes: robot.meshes.map((mesh) => {
      const points = unpack(mesh.points);
      const arrays = () => new Float32Array(points.length / 3);
      return { trace: mesh.trace, points, normals: unpack(mesh.normals), bodies: unpack(mesh.bodies),
        x: arrays(), y: arrays(), z: arrays(), intensity: arrays() };
    }),
  }));

  // Rotation matrix and position of every body between two frames.
  const pose = (robot, at) => {
    const first = Math.floor(at) % robot.frames, next = (first + 1) % robot.frames;
    const share = at - Math.floor(at);
    for (let body = 0; body < robot.bodies; body++) {
      const a = first * robot.bodies + body, b = next * robot.bodies + body;
      const q = [0, 1, 2, 3].map((k) => robot.quaternions[4 * a + k]);
      const r = [0, 1, 2, 3].map((k) => robot.quaternions[4 * b + k]);
      const sign = q.reduce((sum, x, k) => sum + x * r[k], 0) < 0 ? -1 : 1;
      let [w, x, y, z] = q.map((v, k) => (1 - share) * v + share * sign * r[k]);
      const n = Math.hypot(w, x, y, z);
      w /= n; x /= n; y /= n; z /= n;
      const m = robot.pose, o = 12 * body;
      m[o] = 1 - 2 * (y * y + z * z); m[o + 1] = 2 * (x * y - w * z); m[o + 2] = 2 * (x * z + w * y);
      m[o + 3] = 2 * (x * y + w * z); m[o + 4] = 1 - 2 * (x * x + z * z); m[o + 5] = 2 * (y * z - w * x);
      m[o + 6] = 2 * (x * z - w * y); m[o + 7] = 2 * (y * z + w * x); m[o + 8] = 1 - 2 * (x * x + y * y);
      for (let k = 0; k < 3; k++)
        m[o + 9 + k] = robot.quantum *
          ((1 - share) * robot.positions[3 * a + k] + share * robot.positions[3 * b + k]);
    }
  };

  const bend = (mesh, m) => {
    const p = mesh.points, n = mesh.normals;
    for (let i = 0; i < mesh.x.length; i++) {
      const o = 12 * mesh.bodies[i], a = p[3 * i], b = p[3 * i + 1], c = p[3 * i + 2];
      mesh.x[i] = m[o] * a + m[o + 1] * b + m[o + 2] * c + m[o + 9];
      mesh.y[i] = m[o + 3] * a + m[o + 4] * b + m[o + 5] * c + m[o + 10];
      mesh.z[i] = m[o + 6] * a + m[o + 7] * b + m[o + 8] * c + m[o + 11];
      const u = n[3 * i] / 127, v = n[3 * i + 1] / 127, w = n[3 * i + 2] / 127;
      const up = m[o + 6] * u + m[o + 7] * v + m[o + 8] * w;
      const lit = lamp[0] * (m[o] * u + m[o + 1] * v + m[o + 2] * w) +
        lamp[1] * (m[o + 3] * u + m[o + 4] * v + m[o + 5] * w) + lamp[2] * up;
      // Light from a lamp, and from the sky.
      mesh.intensity[i] = 0.6 * Math.max(lit, 0) + 0.4 * (0.5 + 0.5 * up);
    }
  };

  // Marks on the floor that pass below the robot at its speed.
  const marks = ({ at, ahead, half, step }, travel) => {
    const line = { x: [], y: [], z: [] };
    for (let s = -half[0] + (step - (travel % step)) % step; s <= half[0]; s += step)
      for (const side of [-half[1], half[1], null]) {
        line.x.push(side === null ? null : at[0] + s * ahead[0] - side * ahead[1]);
        line.y.push(side === null ? null : at[1] + s * ahead[1] + side * ahead[0]);
        line.z.push(side === null ? null : 0.002);
      }
    return line;
  };

  const draw = (time) => {
    const change = { x: [], y: [], z: [], intensity: [] }, traces = [];
    const add = (trace, { x, y, z, intensity }) => {
      traces.push(trace);
      change.x.push(x); change.y.push(y); change.z.push(z); change.intensity.push(intensity);
    };
    for (const robot of robots) {
      const at = time / robot.period, round = Math.floor(at / robot.frames);
      const frame = at - round * robot.frames;
      pose(robot, frame);
      const travel = round * robot.stride + robot.travel[Math.floor(frame) % robot.frames];
      add(robot.belt.trace, marks(robot.belt, travel));
      for (const mesh of robot.meshes) { bend(mesh, robot.pose); add(mesh.trace, mesh); }
    }
    return Plotly.restyle(panel, change, traces);
  };

  const button = document.getElementById("walk-play");
  const speed = document.getElementById("walk-speed");
  const shown = document.getElementById("walk-shown");
  let playing = false, time = 0, last = 0, held = false, visible = true, drawing = false;
  const frame = (now) => {
    if (!playing) return;
    time += Math.min(now - last, 100) / 1000 * Number(speed.value);
    last = now;
    if (!held && visible && !drawing) {
      drawing = true;
      draw(time).finally(() => { drawing = false; });
    }
    requestAnimationFrame(frame);
  };
  const play = (on) => {
    playing = on;
    button.textContent = on ? "Pause" : "Play";
    if (on) { last = performance.now(); requestAnimationFrame(frame); }
  };
  button.addEventListener("click", () => play(!playing));
  speed.addEventListener("input", () => { shown.textContent = `${Number(speed.value).toFixed(1)} ×`; });
  // A hand that turns the scene is not disturbed.
  panel.addEventListener("pointerdown", () => { held = true; }, true);
  addEventListener("pointerup", () => { held = false; }, true);
  new IntersectionObserver(([entry]) => { visible = entry.isIntersecting; }).observe(panel);
  addEventListener("beforeprint", () => play(false));
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches) play(true);
  window.draftWalk = { draw };  // for measurements
})();
