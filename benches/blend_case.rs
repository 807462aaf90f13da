//! Our side of `compare_blend.py`: warps the cases' targets and composes the mosaics.
//!
//!     cargo run --release -p benches --bin blend-case -- OUT_DIR RUNS CASE_DIR...
//!
//! Writes, for every case, `OUT_DIR/NAME_*.png`: the warped target (alpha is validity) and the reference, which both sides
//! compose, and of ours the mosaic and the mask of which photo shows. Prints a line of JSON
//! per case: its name, the reference's offset on the canvas, the gains, and the least of RUNS times.

use std::path::Path;
use std::time::Instant;

use depthstitch::Image;
use depthstitch::View;
use depthstitch::geometry::{Frame, estimate};
use depthstitch::mosaic::{BlendOptions, SeamGuide, blend};
use depthstitch::pipeline::Options;
use depthstitch::warp::warp;

fn main() {
    let mut args = std::env::args().skip(1);
    let usage = "usage: blend-case OUT_DIR RUNS CASE_DIR...";
    let out = args.next().expect(usage);
    let runs: usize = args.next().expect(usage).parse().expect(usage);
    for folder in args {
        run(Path::new(&folder), Path::new(&out), runs);
    }
}

fn run(folder: &Path, out: &Path, runs: usize) {
    let case = cases::load(folder).photos;
    let (target, reference) = (case.target(), case.reference());
    let frame = |view: &View<'_>| view.image.size();
    let [from, to] = [target, reference].map(|view| Frame { size: frame(&view), depth: view.depth });
    let options = Options::default();
    let geometry = estimate(&case.matches, from, to, &options.estimate, &mut ()).expect("a geometry");
    let warped = warp(target, reference, &geometry.forward, &geometry.reverse, &options.warp, &mut ()).expect("a warp");

    let options = BlendOptions::default();
    let mut best = f64::INFINITY;
    let mut mosaic = blend(&warped, reference.image, &SeamGuide::default(), &options, &mut ()).expect("a mosaic");
    for _ in 0..runs {
        let start = Instant::now();
        mosaic = blend(&warped, reference.image, &SeamGuide::default(), &options, &mut ()).expect("a mosaic");
        best = best.min(start.elapsed().as_secs_f64() * 1e3);
    }

    let name = folder.file_name().expect("a name").to_string_lossy();
    let file = |what: &str| out.join(format!("{name}_{what}.png"));
    write(&file("warped"), &warped.image);
    write(&file("reference"), &case.reference);
    write(&file("mosaic"), &mosaic.image);
    let (width, height) = (mosaic.seam.width() as u32, mosaic.seam.height() as u32);
    let seam = image::GrayImage::from_raw(width, height, mosaic.seam.into_data()).expect("a whole mask");
    seam.save(file("seam")).expect("written");
    let json = serde_json::json!({
        "case": name, "offset": [warped.offset.0, warped.offset.1], "gains": mosaic.gains, "ms": best,
    });
    println!("{json}");
}

fn write(path: &Path, image: &Image) {
    let size = (image.width() as u32, image.height() as u32);
    image::save_buffer(path, image.data(), size.0, size.1, image::ColorType::Rgba8).expect("written");
}
