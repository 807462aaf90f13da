//! What a whole stitch reports on its way, and how it is stopped.
#![allow(clippy::unwrap_used)]

use depthstitch::inverse_depth::DepthKind;
use depthstitch::observer::Observer;
use depthstitch::pipeline::many::{ManyOptions, stitch_many};
use depthstitch::pipeline::{Options, stitch};
use depthstitch::{InverseDepth, Stage, View};
use scene::{MatchOptions, Photos};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

/// Remembers what was reported, and stops at the first report that `stop` is true of.
struct Recorder {
    seen: Vec<(Stage, f32)>,
    stop: fn(Stage, f32) -> bool,
}

impl Observer for Recorder {
    fn progress(&mut self, stage: Stage, fraction: f32) -> bool {
        self.seen.push((stage, fraction));
        !(self.stop)(stage, fraction)
    }
}

/// The stages in their order.
const ORDER: [Stage; 10] = [
    Stage::Input,
    Stage::Detect,
    Stage::Match,
    Stage::Estimate,
    Stage::Depth,
    Stage::Refine,
    Stage::Warp,
    Stage::Blend,
    Stage::Measure,
    Stage::Fill,
];

/// Progress never goes back, within a stage or to an earlier one: a caller may ignore reports that do, as ours in JavaScript
/// does, and with them the chance to stop.
#[test]
fn progress_never_goes_back() {
    let scene = scene::gallery();
    let matches = MatchOptions { count: 300, sigma: 0.3, outliers: 0.1, seed: 1 };
    let photos = Photos::of(&scene.render(240, 160), &matches);
    let [target, reference] = [photos.target(), photos.reference()];
    let without = [target, reference].map(|view| View { depth: None, ..view });
    let noise = |seed: usize| {
        let values: Vec<f32> = (0..240 * 160).map(|i| ((i * 7919 + seed) % 1009) as f32 / 1009.0).collect();
        InverseDepth::new("depth", &values, (240, 160), DepthKind::Inverse, None, (240, 160)).unwrap()
    };
    let noise = [noise(3), noise(500)];
    let wrong = |side: usize| View { depth: Some(&noise[side]), ..without[side] };
    let pairs = [(target, reference), (without[0], reference), (without[0], without[1]), (wrong(0), wrong(1))];
    for (target, reference) in pairs {
        let mut recorder = Recorder { seen: Vec::new(), stop: |_, _| false };
        stitch(None, target, reference, &Options::default(), &mut recorder).unwrap();
        for pair in recorder.seen.windows(2) {
            let [(stage, before), (next, fraction)] = [pair[0], pair[1]];
            assert!(next != stage || fraction >= before, "{stage} goes back from {before} to {fraction}");
            // Guided matching repeats earlier stages, nothing else does.
            let started = |stage: Stage| ORDER.iter().position(|other| *other == stage);
            assert!(next == Stage::Match || started(next) >= started(stage), "{next} follows {stage}");
        }
        let detection = recorder.seen.iter().filter(|(stage, _)| *stage == Stage::Detect);
        let late = detection.filter(|(_, fraction)| *fraction > 0.5 && *fraction < 1.0).count();
        assert!(late >= 3, "{late} reports from the second photo's detection");
    }
    let mut recorder = Recorder { seen: Vec::new(), stop: |stage, at| stage == Stage::Detect && at > 0.6 };
    let error = stitch(None, photos.target(), photos.reference(), &Options::default(), &mut recorder).unwrap_err();
    assert_eq!(error.code(), "aborted");
}

#[test]
fn progress_of_no_stage_goes_back_with_many_photos() {
    let views = scene::gallery_from(&[[-0.4, 0.0, -0.1], [0.0, 0.0, 0.0], [0.4, 0.0, 0.1]]);
    let mut recorder = Recorder { seen: Vec::new(), stop: |_, _| false };
    stitch_many(&scene::photos(&views), &ManyOptions::default(), &mut recorder).unwrap();
    for stage in ORDER {
        let seen: Vec<f32> = recorder.seen.iter().filter(|(other, _)| *other == stage).map(|(_, at)| *at).collect();
        for pair in seen.windows(2) {
            assert!(pair[1] >= pair[0], "{stage} goes back from {} to {}", pair[0], pair[1]);
        }
    }
}
