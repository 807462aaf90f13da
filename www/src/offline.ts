import { byId } from "./dom.js";

/** Registers the service worker, which makes the page available offline. Development builds have none. */
export function bindOffline(): void {
  if (!import.meta.env.PROD || !("serviceWorker" in navigator)) return;
  const report = () => {
    byId("offline", HTMLElement).textContent = "Works offline.";
  };
  navigator.serviceWorker.register(new URL("./service-worker.js", document.baseURI)).then(
    () => void navigator.serviceWorker.ready.then(report),
    () => undefined,
  );
}
