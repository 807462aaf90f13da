//! Keypoints and matches of two photos as one line of JSON: our side of `benches/compare_sift.py`.
//!
//!     cargo run --release -p benches --bin native-features -- TARGET REFERENCE [OPTION=VALUE …]
//!
//! OPTION is a field of `DetectOptions` or `MatchOptions`.

use depthstitch::Image;
use depthstitch::features::{DetectOptions, MatchOptions, detect, match_features, matches_of};

fn main() {
    let (settings, files): (Vec<String>, Vec<String>) = std::env::args().skip(1).partition(|arg| arg.contains('='));
    let [target, reference] = &files[..] else { panic!("usage: native-features TARGET REFERENCE [OPTION=VALUE …]") };
    let (mut how, mut matching) = (DetectOptions::default(), MatchOptions::default());
    for (name, value) in settings.iter().filter_map(|setting| setting.split_once('=')) {
        let number = || value.parse::<f64>().expect("VALUE is a number");
        let flag = || value.parse::<bool>().expect("VALUE is true or false");
        match name {
            "max_keypoints" => how.max_keypoints = number() as usize,
            "max_size" => how.max_size = number() as usize,
            "contrast_threshold" => how.contrast_threshold = number(),
            "edge_threshold" => how.edge_threshold = number(),
            "upsample" => how.upsample = flag(),
            "root" => how.root = flag(),
            "adaptive" => how.adaptive = flag(),
            "ratio" => matching.ratio = number(),
            "max_distance" => matching.max_distance = number(),
            "mutual" => matching.mutual = flag(),
            _ => panic!("there is no option {name}"),
        }
    }
    let [target, reference] =
        [target, reference].map(|file| detect(photo(file).view(), &how, &mut ()).expect("the options are in range"));
    let pairs = match_features(&target, &reference, &matching, &mut ()).expect("the options are in range");
    let matches: Vec<[f64; 4]> = matches_of(&target, &reference, &pairs)
        .iter()
        .map(|m| [m.target[0], m.target[1], m.reference[0], m.reference[1]])
        .collect();
    let line = serde_json::json!({
        "keypoints": [target.keypoints.len(), reference.keypoints.len()],
        "matches": matches,
    });
    println!("{line}");
}

fn photo(path: &str) -> Image {
    let image = image::open(path).unwrap_or_else(|e| panic!("{path}: {e}")).into_rgba8();
    let (width, height) = (image.width() as usize, image.height() as usize);
    Image::new(image.into_raw(), width, height).expect("a photo")
}
