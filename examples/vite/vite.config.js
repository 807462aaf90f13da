export default {
  // Pre-bundling for the development server would separate the package from its worker and wasm files.
  optimizeDeps: { exclude: ["depthstitch"] },
};
