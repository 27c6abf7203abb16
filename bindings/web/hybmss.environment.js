// What the modules ask for: a clock, an environment that has nothing in it; and the one with threads also its memory.

/**
 * The imports of a compiled module. `memory`: that which threads share; of a module of one thread, a function that says
 * where its own is. `more`: functions of the caller's. What else the module has imports for it never calls.
 */
export function environment(module, memory, more = {}) {
  const most = 32768; // pages of 64 KiB
  const view = () => new DataView(memory.buffer ?? memory().buffer);
  const bytes = () => new Uint8Array(memory.buffer);
  const time = (_clock, at) => {
    const now = performance.now();
    view().setUint32(at, now / 1000, true); // s and ns
    view().setUint32(at + 4, (now % 1000) * 1e6, true);
    return 0;
  };
  const known = {
    memory,
    emscripten_notify_memory_growth() {},
    clock_time_get(_clock, _precision, at) {
      view().setBigUint64(at, BigInt(Math.round(performance.now() * 1e6)), true);
      return 0;
    },
    environ_sizes_get(count, size) {
      [count, size].forEach((at) => view().setUint32(at, 0, true));
      return 0;
    },
    environ_get: () => 0,
    clock_gettime: time,
    __clock_gettime: time,
    emscripten_get_now: () => performance.now(),
    emscripten_check_blocking_allowed() {},
    emscripten_memcpy_big: (to, from, count) => bytes().copyWithin(to, from, from + count),
    emscripten_get_heap_max: () => 65536 * most,
    emscripten_resize_heap(wanted) {
      const now = memory.buffer.byteLength / 65536;
      const needed = Math.ceil((wanted >>> 0) / 65536);
      // A fifth more than there is, as the other module takes too, where that can be had.
      for (const pages of [Math.min(Math.max(needed, Math.ceil(1.2 * now)), most), needed]) {
        try {
          memory.grow(pages - now);
          return 1;
        } catch {}
      }
      return 0;
    },
    ...more,
  };
  const imports = {};
  for (const { module: from, name } of WebAssembly.Module.imports(module)) {
    imports[from] ??= {};
    imports[from][name] = known[name] ?? (() => {
      throw new Error(`the module ended itself: ${name}`);
    });
  }
  return imports;
}
