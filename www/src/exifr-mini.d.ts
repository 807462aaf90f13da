/** The smallest of exifr's builds: JPEG only, no names of tags. The package has types for its largest build alone. */
declare module "exifr/dist/mini.esm.mjs" {
  export function parse(
    data: ArrayBuffer,
    options: {
      readonly tiff: boolean;
      readonly exif: readonly number[];
      readonly translateKeys: boolean;
    },
  ): Promise<Readonly<Record<string, unknown>> | undefined>;
}
