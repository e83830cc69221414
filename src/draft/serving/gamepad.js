"use strict";
// Sends the state of the first gamepad, as whole percents, when it changes: at most every 50 ms,
// and only after the previous request has been answered.
const DEAD = 0.15, EVERY = 50, RETRY = 1000;
const LEFT_SHOULDER = 4, RIGHT_SHOULDER = 5;
const state = document.getElementById("state");
let sent = "0/0/0/0", held = 0, busy = false;

function percent(value) {
  const size = Math.max(0, Math.abs(value || 0) - DEAD) / (1 - DEAD);
  return Math.round(100 * Math.sign(value) * Math.min(1, size)) || 0;
}

function shoulders(pad) {
  const down = (index) => Number(Boolean(pad.buttons[index] && pad.buttons[index].pressed));
  return down(RIGHT_SHOULDER) - down(LEFT_SHOULDER);
}

async function poll() {
  const pads = [...navigator.getGamepads()].filter((one) => one && one.connected);
  // Of other mappings it is not known which axis is a stick and which a trigger.
  const pad = pads.find((one) => one.mapping === "standard");
  const known = pads.length ? `${pads[0].id} has no standard mapping` : "none; press a button of it";
  state.textContent = pad ? pad.id : known;
  if (busy) return;
  let moved = "0/0/0/0";
  if (pad) {
    const [x, y, turn] = pad.axes;
    const pressed = shoulders(pad);
    const push = pressed === held ? 0 : pressed;
    held = pressed;
    moved = [percent(-y), percent(-x), percent(-turn), push].join("/");
  }
  if (moved === sent) return;
  busy = true;
  try {
    await fetch(`${location.pathname}/${moved}`, { cache: "no-store" });
    sent = moved.replace(/-?1$/, "0");
  } catch {
    await new Promise((resume) => setTimeout(resume, RETRY));
  } finally {
    busy = false;
  }
}

if (navigator.getGamepads) setInterval(poll, EVERY);
else state.textContent = "this browser offers it to pages of https and localhost only";
