// Keeps the page, so that it opens without a network. Version and files are put in by the build.

/** The part of `ServiceWorkerGlobalScope` used here; TypeScript's DOM library has only the window's. */
interface ServiceWorkerScope extends EventTarget {
  readonly registration: { readonly scope: string };
  readonly clients: { claim(): Promise<void> };
}
interface LongEvent extends Event {
  waitUntil(work: Promise<unknown>): void;
}
interface FetchEvent extends LongEvent {
  readonly request: Request;
  respondWith(response: Promise<Response>): void;
}

const worker = globalThis as unknown as ServiceWorkerScope;
const cacheName = "depthstitch __VERSION__";
const files = "__FILES__".split(" ");

// A new version waits until the pages of the old one are gone: they may still need its files.
worker.addEventListener("install", (event) => {
  (event as LongEvent).waitUntil(caches.open(cacheName).then((cache) => cache.addAll(files)));
});

worker.addEventListener("activate", (event) => {
  (event as LongEvent).waitUntil(forgetOthers().then(() => worker.clients.claim()));
});

worker.addEventListener("fetch", (event) => {
  const { request } = event as FetchEvent;
  // Only the page's own files; networks from elsewhere are kept by their libraries.
  if (request.method !== "GET" || !request.url.startsWith(worker.registration.scope)) return;
  (event as FetchEvent).respondWith(answer(request));
});

/** Caches of earlier versions of this page, and of nothing else that lives on the same host. */
async function forgetOthers(): Promise<void> {
  const names = await caches.keys();
  const old = names.filter((name) => name.startsWith("depthstitch ") && name !== cacheName);
  await Promise.all(old.map((name) => caches.delete(name)));
}

async function answer(request: Request): Promise<Response> {
  const cache = await caches.open(cacheName);
  if (request.mode === "navigate") {
    // The newest page where there is a network, the kept one where there is none.
    return fetch(request).catch(async (error: unknown) => {
      const kept = await cache.match("./");
      if (kept) return kept;
      throw error;
    });
  }
  const kept = await cache.match(request, { ignoreVary: true });
  if (kept) return kept;
  const response = await fetch(request);
  if (response.status === 200) void cache.put(request, response.clone());
  return response;
}
