//! Memory that the pipeline really takes, against what it predicts.
#![cfg(not(target_arch = "wasm32"))]
#![allow(unsafe_code, clippy::unwrap_used)]

mod scene;

use std::alloc::{GlobalAlloc, Layout, System};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use depthstitch::Stage;
use depthstitch::observer::Observer;
use depthstitch::pipeline::{Options, stitch};
use scene::{MatchOptions, Photos};

struct Counting;
static LIVE: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

fn add(bytes: usize) {
    let live = LIVE.fetch_add(bytes, Relaxed) + bytes;
    PEAK.fetch_max(live, Relaxed);
}

// SAFETY: every call goes to the system's allocator as it is; the counters hold no memory.
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
        // In wasm a block that grows is copied.
        add(size);
        LIVE.fetch_sub(layout.size(), Relaxed);
        unsafe { System.realloc(block, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// The most memory in use during each stage.
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

#[test]
fn table() {
    let sizes: Vec<f64> = std::env::var("MP").unwrap_or("0.25".into()).split(',').map(|v| v.parse().unwrap()).collect();
    for mp in sizes {
        let w = (mp * 1e6 * 1000.0 / 662.0f64).sqrt().round() as usize;
        let h = (w as f64 * 0.662).round() as usize;
        let sampled = MatchOptions { count: 1000, sigma: 0.3, outliers: 0.1, seed: 1 };
        let photos = Photos::of(&scene::gallery().render(w, h), &sampled);
        let none = Photos { target_depth: None, reference_depth: None, ..photos.clone() };
        let runs: [(&str, &Photos, Option<&[_]>, Options); 5] = [
            ("photos", &none, None, Options::default()),
            ("photos+matches", &none, Some(&photos.matches), Options::default()),
            ("depth", &photos, None, Options::default()),
            ("depth+matches", &photos, Some(&photos.matches), Options::default()),
            ("paper+matches", &photos, Some(&photos.matches), Options::paper()),
        ];
        for (name, photos, matches, options) in runs {
            let before = LIVE.load(Relaxed);
            let mut peaks = Peaks::default();
            peaks.close();
            let found = stitch(matches, photos.target(), photos.reference(), &options, &mut peaks).unwrap();
            peaks.close();
            let px = (w * h) as f64;
            let canvas = (found.mosaic.image.width * found.mosaic.image.height) as f64 / px;
            print!("{name:16} {mp:5} MP canvas {canvas:.3}:");
            for (stage, peak) in &peaks.peaks {
                print!(" {stage} {:.1}", (peak.saturating_sub(before)) as f64 / px);
            }
            println!(" end {:.1}", (LIVE.load(Relaxed) - before) as f64 / px);
        }
    }
}
