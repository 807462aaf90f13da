//! Line segments of a photo as one line of JSON, and the time taken: our side of a comparison with other detectors.
//!
//!     cargo run --release -p benches --bin native-line-segments -- PHOTO

use depthstitch::Image;
use depthstitch::features::{LineSegmentOptions, line_segments};

fn main() {
    let path = std::env::args().nth(1).expect("usage: native-line-segments PHOTO");
    let image = image::open(&path).unwrap_or_else(|e| panic!("{path}: {e}")).into_rgba8();
    let (width, height) = (image.width() as usize, image.height() as usize);
    let image = Image::new(image.into_raw(), width, height).expect("an image");
    let start = std::time::Instant::now();
    let segments = line_segments(image.view(), &LineSegmentOptions::default()).expect("the options are in range");
    let seconds = start.elapsed().as_secs_f64();
    let lines: Vec<[f64; 4]> = segments.iter().map(|s| [s.start[0], s.start[1], s.end[0], s.end[1]]).collect();
    println!("{}", serde_json::json!({ "seconds": seconds, "lines": lines }));
}
