// The kinds of options, and what the table in options.ts says of each.

/** The part of the pipeline that an option belongs to. */
export type OptionGroup = "preset" | "matching" | "geometry" | "warping" | "compositing";

interface Description<T> {
  readonly group: OptionGroup;
  /** A short name for user interfaces. */
  readonly label: string;
  /** One sentence, or two. */
  readonly description: string;
  /** Unit of a number, where it has one. */
  readonly unit?: string;
  readonly default: T;
  /** The default with `mode: "paper"`, where it is another. */
  readonly paper?: T;
}

export interface ChoiceOption extends Description<string> {
  readonly type: "choice";
  /** The values, in the order of the core's enums, each with a short name for user interfaces. */
  readonly choices: Readonly<Record<string, string>>;
}

export interface NumberOption extends Description<number | string> {
  readonly type: "number" | "integer";
  readonly min: number;
  /** Absent if there is no largest value. */
  readonly max?: number;
  /** Whether `min` itself is out of range. */
  readonly exclusiveMin?: true;
  /** Whether `max` itself is out of range. */
  readonly exclusiveMax?: true;
  /** A word that may stand in place of a number. */
  readonly keyword?: string;
}

export interface BooleanOption extends Description<boolean> {
  readonly type: "boolean";
}

/** What is known about one option. */
export type OptionSpec = ChoiceOption | NumberOption | BooleanOption;
