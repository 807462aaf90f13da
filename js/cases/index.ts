/**
 * Parsers of the files of a case: `case.json`, matches as CSV, and arrays as NumPy's `.npy`. They take the contents of a
 * file and run in browsers and in Node.
 */
export {
  parseCase,
  type CaseDescription,
  type DepthFiles,
  type DepthFormat,
  type PairFiles,
  type TrueMap,
} from "./case-file.js";
export { FileError, type FileErrorCode } from "./errors.js";
export { parseMatches } from "./matches-file.js";
export { parseNpy, type NumericArray } from "./npy.js";
