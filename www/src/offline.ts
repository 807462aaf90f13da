import { byId } from "./dom.js";

/** Has the service worker keep the page, so that it opens without a network. Development has none. */
export function bindOffline(): void {
  if (!import.meta.env.PROD || !("serviceWorker" in navigator)) return;
  const say = () => {
    byId("offline", HTMLElement).textContent = "Works offline.";
  };
  navigator.serviceWorker.register(new URL("./service-worker.js", document.baseURI)).then(
    () => void navigator.serviceWorker.ready.then(say),
    () => undefined,
  );
}
