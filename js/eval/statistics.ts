/** The p-th percentile (0 to 100), linear between the two nearest ranks: NumPy's default. NaN for no values. */
export function percentile(values: ArrayLike<number>, p: number): number {
  const sorted = Float64Array.from(values).sort();
  const rank = ((sorted.length - 1) * p) / 100;
  const below = sorted[Math.floor(rank)] ?? NaN;
  const above = sorted[Math.ceil(rank)] ?? NaN;
  // Not below + (above - below)·f where both are infinite: that would be NaN.
  return below === above ? below : below + (above - below) * (rank - Math.floor(rank));
}

/** The middle value, or the mean of the two middle ones. NaN for no values. */
export function median(values: ArrayLike<number>): number {
  return percentile(values, 50);
}

/** The mean of those values that there are, or undefined of none. */
export function mean(values: readonly (number | null | undefined)[]): number | undefined {
  const known = values.filter((value): value is number => !Number.isNaN(value ?? NaN));
  if (known.length === 0) return undefined;
  return known.reduce((sum, value) => sum + value, 0) / known.length;
}
