//! Memory that the pipeline really takes, against what it predicts. `DEPTHSTITCH_MEGAPIXELS=1,3,12` measures larger photos.
#![cfg(not(target_arch = "wasm32"))]
#![allow(unsafe_code, clippy::unwrap_used)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError};

use depthstitch::geometry::Match;
use depthstitch::mosaic::{BlendOptions, Blending, Seam};
use depthstitch::observer::Observer;
use depthstitch::pipeline::{Job, Memory, Options, stitch};
use depthstitch::{Stage, View};
use scene::{MatchOptions, Photos};

/// Counts the bytes that are in use.
struct Counting;
static LIVE: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

fn add(bytes: usize) {
    let live = LIVE.fetch_add(bytes, Relaxed) + bytes;
    PEAK.fetch_max(live, Relaxed);
}

// SAFETY: every call is passed on to the system's allocator unchanged; counting takes no memory.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        add(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        add(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(block, layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // A block that grows may have to be copied.
        add(size);
        LIVE.fetch_sub(layout.size(), Relaxed);
        unsafe { System.realloc(block, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// One test at a time: they share the counters.
static ALONE: Mutex<()> = Mutex::new(());

/// The most bytes in use during each stage.
#[derive(Default)]
struct Peaks {
    stage: &'static str,
    peaks: BTreeMap<&'static str, usize>,
}

impl Peaks {
    fn close(&mut self) {
        let peak = PEAK.swap(LIVE.load(Relaxed), Relaxed);
        let known = self.peaks.entry(self.stage).or_default();
        *known = peak.max(*known);
    }
}

impl Observer for Peaks {
    fn progress(&mut self, stage: Stage, _: f32) -> bool {
        self.close();
        self.stage = stage.name();
        true
    }
}

/// Bytes that stitching takes, photos and depth maps included, and what was predicted for its canvas; both by pixel of
/// the target.
fn measure(name: &str, matches: Option<&[Match]>, views: [View<'_>; 2], options: &Options) -> [f64; 2] {
    let job = Job::of(views, matches.is_some());
    let inputs: usize =
        views.iter().map(|view| (4 + 4 * usize::from(view.depth.is_some())) * view.image.pixels().len()).sum();
    let mut peaks = Peaks::default();
    let before = LIVE.load(Relaxed);
    PEAK.store(before, Relaxed);
    let found = stitch(matches, views[0], views[1], options, &mut peaks).unwrap();
    peaks.close();
    let canvas = found.mosaic.image.size();
    let (stage, predicted) = Memory::of(job, options).peak(canvas);
    let pixels = views[0].image.pixels().len() as f64;
    let bytes = |peak: usize| (peak - before + inputs) as f64 / pixels;
    let measured = bytes(peaks.peaks.values().copied().max().unwrap());
    let predicted = predicted as f64 / pixels;
    let stages: Vec<String> = peaks.peaks.iter().map(|(stage, peak)| format!("{stage} {:.1}", bytes(*peak))).collect();
    println!(
        "{:.2} MP, {name}: predicted {predicted:.1} bytes per pixel ({stage}), measured {measured:.1} ({:+.0} %), canvas {:.2}: {}",
        pixels / 1e6,
        100.0 * (predicted / measured - 1.0),
        (canvas.0 * canvas.1) as f64 / pixels,
        stages.join(", ")
    );
    [predicted, measured]
}

#[test]
fn the_predicted_peak_is_right_to_a_fifth() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let sizes = std::env::var("DEPTHSTITCH_MEGAPIXELS").unwrap_or("0.06,0.25".into());
    let mut wrong = Vec::new();
    for megapixels in sizes.split(',').map(|size| size.parse::<f64>().unwrap()) {
        let width = (megapixels * 1e6 / 0.662).sqrt();
        let sampled = MatchOptions { count: 1000, sigma: 0.3, outliers: 0.1, seed: 1 };
        let scene = scene::gallery();
        let photos = Photos::of(&scene.render(width as usize, (0.662 * width) as usize), &sampled);
        let without = [photos.target(), photos.reference()].map(|view| View { depth: None, ..view });
        let with = [photos.target(), photos.reference()];
        let given = Some(&photos.matches[..]);
        let smooth = Options { refine: None, ..Options::paper() };
        let feathered = Options {
            blend: BlendOptions { blending: Blending::Feather, seam: Seam::Cut, ..BlendOptions::default() },
            fill: None,
            ..smooth.clone()
        };
        for (name, matches, views, options) in [
            ("two photos", None, without, Options::default()),
            ("two photos and matches", given, without, Options::default()),
            ("depth maps", None, with, Options::default()),
            ("depth maps and matches", given, with, Options::default()),
            ("paper", None, with, Options::paper()),
            ("paper and matches", given, with, smooth),
            ("feathered", given, with, feathered),
        ] {
            let [predicted, measured] = measure(name, matches, views, &options);
            if (predicted / measured - 1.0).abs() > 0.2 {
                wrong.push(format!("{megapixels} MP, {name}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// What is refused takes no memory.
#[test]
fn a_job_above_the_limit_is_refused_before_anything_is_allocated() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let sampled = MatchOptions { count: 300, sigma: 0.3, outliers: 0.1, seed: 1 };
    let photos = Photos::of(&scene::gallery().render(240, 160), &sampled);
    let views = [photos.target(), photos.reference()];
    let mut options = Options::default();
    let (_, needed) = Memory::of(Job::of(views, false), &options).peak((240, 160));
    options.warp.max_bytes = needed - 1;
    let mut peaks = Peaks::default();
    let before = LIVE.load(Relaxed);
    PEAK.store(before, Relaxed);
    let error = stitch(None, views[0], views[1], &options, &mut peaks).unwrap_err();
    let taken = PEAK.load(Relaxed) - before;
    assert_eq!(error.code(), "too-large");
    assert_eq!(
        error.details(),
        [("width", 240.0), ("height", 160.0), ("bytes", needed as f64), ("limit", needed as f64 - 1.0)]
    );
    assert!(taken < 10_000, "{taken} bytes");
}
