//! The TypeScript types of the functions' arguments and results; they are declared in `types.d.ts`.

use wasm_bindgen::prelude::*;

#[wasm_bindgen]
extern "C" {
    /// `ImageInput`.
    #[wasm_bindgen(typescript_type = "ImageInput")]
    pub type ImageInput;
    /// `Options`, each optional.
    #[wasm_bindgen(typescript_type = "Partial<Options> | undefined")]
    pub type PartialOptions;
    /// Which defaults.
    #[wasm_bindgen(typescript_type = "Options[\"mode\"] | undefined")]
    pub type ModeName;
    /// `Options`.
    #[wasm_bindgen(typescript_type = "Options")]
    pub type FullOptions;
    /// Progress callback.
    #[wasm_bindgen(
        typescript_type = "((stage: Stage, fraction: number, subject: number | [number, number] | undefined) => boolean | void) | undefined"
    )]
    pub type OnProgress;
    /// Workers besides this one, and a function that has one of them perform a call and gives an object that will have its result.
    #[wasm_bindgen(
        typescript_type = "{ readonly others: number; perform(name: string, args: unknown[]): { result?: unknown } } | undefined"
    )]
    pub type OtherWorkers;
    /// What `stitch` takes besides the photos.
    #[wasm_bindgen(typescript_type = "StitchInputs")]
    pub type StitchInputs;
    /// `Features`.
    #[wasm_bindgen(typescript_type = "Features")]
    pub type FeaturesObject;
    /// `Matches`.
    #[wasm_bindgen(typescript_type = "Matches")]
    pub type MatchesObject;
    /// `ImageMatches`.
    #[wasm_bindgen(typescript_type = "ImageMatches")]
    pub type ImageMatches;
    /// What `estimate` takes.
    #[wasm_bindgen(typescript_type = "EstimateInputs")]
    pub type EstimateInputs;
    /// What `blend` may know besides the photos.
    #[wasm_bindgen(typescript_type = "{ readonly reliable?: Mask | null | undefined }")]
    pub type BlendInputs;
    /// Both models.
    #[wasm_bindgen(typescript_type = "Models")]
    pub type Models;
    /// Both depth maps.
    #[wasm_bindgen(typescript_type = "Depths")]
    pub type Depths;
    /// `Geometry`.
    #[wasm_bindgen(typescript_type = "Geometry")]
    pub type Geometry;
    /// `Warped`.
    #[wasm_bindgen(typescript_type = "Warped")]
    pub type WarpedObject;
    /// `Mosaic`.
    #[wasm_bindgen(typescript_type = "Mosaic")]
    pub type MosaicObject;
    /// `Mask`.
    #[wasm_bindgen(typescript_type = "Mask")]
    pub type MaskObject;
    /// `ImageOutput`.
    #[wasm_bindgen(typescript_type = "ImageOutput")]
    pub type ImageOutput;
    /// `Quality`.
    #[wasm_bindgen(typescript_type = "Quality")]
    pub type QualityObject;
    /// The photos of `stitchMany`.
    #[wasm_bindgen(typescript_type = "readonly PhotoInput[]")]
    pub type PhotoInputs;
    /// What `stitchMany` takes besides them.
    #[wasm_bindgen(typescript_type = "ManyInputs")]
    pub type ManyInputs;
}
