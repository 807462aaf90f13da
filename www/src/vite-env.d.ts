/** What the bundler puts into the page's modules. */
interface ImportMeta {
  readonly env: { readonly PROD: boolean };
}
