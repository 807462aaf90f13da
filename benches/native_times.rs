//! Median times of every stage on a case folder, as one line of JSON: the native side of `npm run bench`.
//!
//!     cargo run --release -p benches --bin native-times -- CASE_DIR paper|depth|photos [RUNS]
//!
//! `paper` is the published method with the case's matches and depth maps, `depth` our own way with its depth maps,
//! `photos` that with the photos alone.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use depthstitch::observer::Observer;
use depthstitch::pipeline::{Options, stitch};

struct Clock(Instant);

impl Observer for Clock {
    fn now(&mut self) -> f64 {
        self.0.elapsed().as_secs_f64() * 1e3
    }
}

fn main() {
    let mut args = std::env::args().skip(1);
    let [folder, way] = [(); 2].map(|()| args.next().expect("usage: native-times CASE_DIR paper|depth|photos [RUNS]"));
    let runs: usize = args.next().map_or(15, |n| n.parse().expect("RUNS is a number"));
    let mut case = cases::load(Path::new(&folder)).photos;
    let options = if way == "paper" { Options::paper() } else { Options::default() };
    if way == "photos" {
        (case.target_depth, case.reference_depth) = (None, None);
    }
    let matches = (way == "paper").then_some(&case.matches[..]);
    let mut clock = Clock(Instant::now());
    let mut samples: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for run in 0..=runs {
        let start = clock.now();
        let done = stitch(matches, case.target(), case.reference(), &options, &mut clock).expect("the case stitches");
        let whole = clock.now() - start;
        if run > 0 {
            samples.entry("stitch").or_default().push(whole);
            done.times.iter().for_each(|(stage, ms)| samples.entry(stage.name()).or_default().push(*ms));
        }
    }
    let medians: BTreeMap<&str, f64> = samples
        .into_iter()
        .map(|(name, mut ms)| {
            ms.sort_by(f64::total_cmp);
            (name, ms[ms.len() / 2])
        })
        .collect();
    println!("{}", serde_json::to_string(&medians).expect("JSON"));
}
