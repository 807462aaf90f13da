// Caches the page for offline use. Version and files are inserted by the build.

/** The part of `ServiceWorkerGlobalScope` used here; TypeScript's DOM library declares windows only. */
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
// What the browser remembers of them may be of the version before.
const fresh = files.map((file) => new Request(file, { cache: "reload" }));

// A new version is activated when no page of the old one is open any more, as those may still need its files.
worker.addEventListener("install", (event) => {
  (event as LongEvent).waitUntil(caches.open(cacheName).then((cache) => cache.addAll(fresh)));
});

worker.addEventListener("activate", (event) => {
  (event as LongEvent).waitUntil(deleteOtherCaches().then(() => worker.clients.claim()));
});

worker.addEventListener("fetch", (event) => {
  const { request } = event as FetchEvent;
  // Only files of the page; networks from other hosts are cached by their libraries.
  const { scope } = worker.registration;
  if (request.method !== "GET" || !request.url.startsWith(scope)) return;
  // The reference of the API may lie below the page. It is no part of it, and its files keep their names when they change.
  if (request.url.startsWith(`${scope}api/`)) return;
  (event as FetchEvent).respondWith(answer(request));
});

/** Deletes the caches of other versions of this page, but no others of the same origin. */
async function deleteOtherCaches(): Promise<void> {
  const names = await caches.keys();
  const old = names.filter((name) => name.startsWith("depthstitch ") && name !== cacheName);
  await Promise.all(old.map((name) => caches.delete(name)));
}

async function answer(request: Request): Promise<Response> {
  const cache = await caches.open(cacheName);
  if (request.mode === "navigate") {
    // The current page from the network, or the cached one when offline.
    return fetch(request).catch(async (error: unknown) => {
      const cached = await cache.match("./");
      if (cached) return cached;
      throw error;
    });
  }
  const cached = await cache.match(request, { ignoreVary: true });
  if (cached) return cached;
  const response = await fetch(request);
  if (response.status === 200) void cache.put(request, response.clone());
  return response;
}
