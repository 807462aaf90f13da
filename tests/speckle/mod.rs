//! Pictures of blobs, exact under any warp, and what is found in them.
#![allow(dead_code)] // each test uses its own part

use depthstitch::Image;
use depthstitch::features::{DetectOptions, Features, MatchOptions, detect, match_features, matches_of};
use depthstitch::geometry::Match;
use nalgebra::{Matrix3, Vector3};

use scene::Random;

/// Blobs of every size, evaluated anywhere: what is drawn through a warp is exact.
pub struct Speckle(pub Vec<[f64; 4]>);

impl Speckle {
    pub fn new(width: f64, height: f64, count: usize) -> Self {
        let mut random = Random::new(7);
        let blob = |_| {
            let size = 1.2 / (0.1 + 0.9 * random.uniform());
            [random.uniform() * width, random.uniform() * height, size, 160.0 * (random.uniform() - 0.5)]
        };
        Self((0..count).map(blob).collect())
    }

    /// The picture whose pixel p shows the point `place(p)`, integrated over the pixel's area by 3×3 samples.
    pub fn draw(&self, width: usize, height: usize, place: impl Fn(f64, f64) -> [f64; 2]) -> Image {
        const CELL: f64 = 24.0;
        let mut image = Image::transparent(width, height).unwrap();
        let mut cells = std::collections::BTreeMap::<(i32, i32), Vec<[f64; 4]>>::new();
        for blob in &self.0 {
            let reach = 4.0 * blob[2];
            let cell = |v: f64| (v / CELL).floor() as i32;
            for j in cell(blob[1] - reach)..=cell(blob[1] + reach) {
                for i in cell(blob[0] - reach)..=cell(blob[0] + reach) {
                    cells.entry((i, j)).or_default().push(*blob);
                }
            }
        }
        for (i, pixel) in image.data_mut().chunks_exact_mut(4).enumerate() {
            let (x, y) = ((i % width) as f64, (i / width) as f64);
            let mut value = 0.0;
            for k in 0..9 {
                let [u, v] = place(x + f64::from(k % 3 - 1) / 3.0, y + f64::from(k / 3 - 1) / 3.0);
                let near = cells.get(&((u / CELL).floor() as i32, (v / CELL).floor() as i32));
                for [bx, by, size, height] in near.into_iter().flatten() {
                    let square = ((u - bx) * (u - bx) + (v - by) * (v - by)) / (2.0 * size * size);
                    value += if square < 8.0 { height * libm::exp(-square) } else { 0.0 };
                }
            }
            let gray = (128.0 + value / 9.0).round().clamp(0.0, 255.0) as u8;
            pixel.copy_from_slice(&[gray, gray, gray, 255]);
        }
        image
    }
}

pub const SIZE: (usize, usize) = (320, 240);

pub fn speckle() -> Speckle {
    Speckle::new(SIZE.0 as f64, SIZE.1 as f64, 900)
}

pub fn plain(speckle: &Speckle) -> Image {
    speckle.draw(SIZE.0, SIZE.1, |x, y| [x, y])
}

pub fn found(image: &Image, options: &DetectOptions) -> Features {
    detect(image.view(), options, &mut ()).unwrap()
}

pub fn matched(target: &Features, reference: &Features) -> Vec<Match> {
    let pairs = match_features(target, reference, &MatchOptions::default(), &mut ()).unwrap();
    matches_of(target, reference, &pairs)
}

/// Similarity about the picture's centre, and its inverse.
pub fn turn(angle: f64, scale: f64) -> (Matrix3<f64>, Matrix3<f64>) {
    let (cx, cy) = (SIZE.0 as f64 / 2.0 + 1.3, SIZE.1 as f64 / 2.0 - 0.4);
    let (c, s) = (scale * libm::cos(angle), scale * libm::sin(angle));
    let h = Matrix3::new(c, -s, cx - c * cx + s * cy, s, c, cy - s * cx - c * cy, 0.0, 0.0, 1.0);
    (h, h.try_inverse().unwrap())
}

pub fn through(h: &Matrix3<f64>, [x, y]: [f64; 2]) -> [f64; 2] {
    let p = h * Vector3::new(x, y, 1.0);
    [p.x / p.z, p.y / p.z]
}
