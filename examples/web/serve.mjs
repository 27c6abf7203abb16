// Serves a folder on this machine: node examples/web/serve.mjs FOLDER PORT. Isolated from other origins by two headers,
// without which browsers give a page no threads that share memory.
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { resolve } from "node:path";
import { fileURLToPath } from "node:url";

const types = { html: "text/html", css: "text/css", js: "text/javascript", wasm: "application/wasm", json: "application/json" };
const isolation = { "cross-origin-opener-policy": "same-origin", "cross-origin-embedder-policy": "require-corp" };

export async function serve(folder, port = 0, isolated = true) {
  const root = `${resolve(folder)}/`;
  const server = createServer(async ({ url }, response) => {
    try {
      const path = decodeURIComponent(new URL(url, "http://here").pathname);
      const file = resolve(root + (path.endsWith("/") ? `${path}index.html` : path));
      if (!file.startsWith(root)) throw new Error("outside");
      const body = await readFile(file);
      const type = types[file.split(".").at(-1)] ?? "application/octet-stream";
      response.writeHead(200, { "content-type": type, ...(isolated ? isolation : {}) }).end(body);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((listening, failed) => server.on("error", failed).listen(port, "127.0.0.1", listening));
  return { address: `http://127.0.0.1:${server.address().port}`, close: () => server.close() };
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const [, , folder, port] = process.argv;
  try {
    console.log(`${folder}: ${(await serve(folder, Number(port))).address}`);
  } catch (error) {
    console.error(`serve.mjs: port ${port} is not to be had: ${error.message}`);
    process.exit(1);
  }
}
