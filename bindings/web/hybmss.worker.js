// A thread of the module: what hybmss.js starts, in a browser or in node, and lets into the module's memory.
import { environment } from "./hybmss.environment.js";

const port = typeof WorkerGlobalScope === "undefined" ? (await import("node:worker_threads")).parentPort : globalThis;
let wasm = null;

/** First the module and its memory; then, once, what to work on. */
function receive({ module, memory, thread, stack, routine, argument }) {
  if (module) {
    wasm = new WebAssembly.Instance(module, environment(module, memory)).exports;
    port.postMessage("ready");
    return;
  }
  wasm.stackRestore(stack); // nothing before it may write to a stack: until then it is the main thread's
  wasm._emscripten_thread_init(thread, 0, 0, 1, 0);
  wasm.emscripten_tls_init();
  wasm.__indirect_function_table.get(routine)(argument); // for good: threads last as long as the program
}

if (port.on) {
  port.on("message", receive);
} else {
  port.onmessage = ({ data }) => receive(data);
}
