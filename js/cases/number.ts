/** The finite decimal number in `text`, undefined if it is anything else: `Number` would accept "", "0x10" and "Infinity". */
export function parseDecimal(text: string): number | undefined {
  const value = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(text) ? Number(text) : NaN;
  return Number.isFinite(value) ? value : undefined;
}
