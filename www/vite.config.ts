import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { defineConfig, transformWithOxc, type Plugin } from "vite";

/**
 * The content security policy of the built page: scripts and WebAssembly of its own only. Other hosts may be connected
 * to for networks that the user requests. The development server injects inline styles, so the policy is part of the
 * build only.
 */
const policy = [
  "default-src 'none'",
  "script-src 'self' 'wasm-unsafe-eval'",
  "worker-src 'self'",
  "connect-src 'self' https:",
  "style-src 'self'",
  "img-src 'self'",
  "manifest-src 'self'",
  "base-uri 'none'",
  "form-action 'none'",
].join("; ");

const contentSecurityPolicy: Plugin = {
  name: "content-security-policy",
  apply: "build",
  transformIndexHtml: () => [
    {
      tag: "meta",
      attrs: { "http-equiv": "Content-Security-Policy", content: policy },
      injectTo: "head-prepend",
    },
  ],
};

/** Puts the page together: `<!-- part: photos -->` stands for `parts/photos.html`. */
const parts: Plugin = {
  name: "parts",
  transformIndexHtml: {
    order: "pre",
    handler: (html) =>
      html.replace(/<!-- part: (\w+) -->/g, (_, name: string) =>
        readFileSync(join(import.meta.dirname, "parts", `${name}.html`), "utf8"),
      ),
  },
};

/** Files that only networks need are large, so they are cached on first use. */
const cachedOnUse = /\bort[.-]|transformers/;

/** Writes the service worker with the names of the files to cache. */
const serviceWorker: Plugin = {
  name: "service-worker",
  apply: "build",
  enforce: "post",
  async generateBundle(_, bundle) {
    const files = Object.keys(bundle).filter(
      (name) => !cachedOnUse.test(name) && !/\.map$/.test(name),
    );
    const hash = createHash("sha256");
    for (const name of files.sort()) {
      const file = bundle[name];
      hash.update(name).update(file?.type === "chunk" ? file.code : (file?.source ?? ""));
    }
    const source = readFileSync(join(import.meta.dirname, "src", "service-worker.ts"), "utf8");
    const { code } = await transformWithOxc(source, "service-worker.ts", {});
    this.emitFile({
      type: "asset",
      fileName: "service-worker.js",
      source: code.replace("__VERSION__", hash.digest("hex").slice(0, 16)).replace(
        "__FILES__",
        JSON.stringify([
          "./",
          "icon.svg",
          "manifest.webmanifest",
          ...files.filter((name) => name !== "index.html"),
        ])
          .slice(1, -1)
          .replaceAll('"', "")
          .replaceAll(",", " "),
      ),
    });
  },
};

export default defineConfig({
  root: import.meta.dirname,
  base: "./",
  plugins: [parts, contentSecurityPolicy, serviceWorker],
  worker: { format: "es" },
  // These libraries look for their wasm next to their scripts, which pre-bundling would move.
  optimizeDeps: {
    exclude: ["onnxruntime-web", "@huggingface/transformers"],
    include: ["exifr/dist/mini.esm.mjs"],
  },
  build: {
    target: "es2022",
    outDir: "dist",
    emptyOutDir: true,
    // A data: URL would need a wider policy.
    assetsInlineLimit: 0,
  },
});
