/** MuJoCo in WebAssembly, whose package has no types of this form. */
export default function loadMujoco(options: { wasmBinary: ArrayBuffer; locateFile: () => string }): Promise<any>;
