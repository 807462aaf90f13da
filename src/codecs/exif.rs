//! The EXIF data of a photo, a TIFF file without an image (CIPA DC-008, section 4.6): what they say of its lens, and made to fit a picture
//! that was made of it.

use std::ops::Range;

use crate::rect::diagonal;

/// Tags whose values are rewritten, and those that lead to other directories.
const IMAGE_WIDTH: u16 = 0x0100;
const IMAGE_LENGTH: u16 = 0x0101;
const ORIENTATION: u16 = 0x0112;
const EXIF: u16 = 0x8769;
const GPS: u16 = 0x8825;
const PIXEL_X_DIMENSION: u16 = 0xa002;
const PIXEL_Y_DIMENSION: u16 = 0xa003;
const INTEROPERABILITY: u16 = 0xa005;

/// Tags of the lens and the sensor.
const FOCAL_LENGTH: u16 = 0x920a;
const FOCAL_PLANE_X_RESOLUTION: u16 = 0xa20e;
const FOCAL_PLANE_RESOLUTION_UNIT: u16 = 0xa210;
const FOCAL_LENGTH_IN_35MM_FILM: u16 = 0xa405;
/// The diagonal of 35 mm film in millimetres.
const DIAGONAL_OF_35MM_FILM: f64 = 43.27;
/// A photo whose sides have another ratio than they had, by more than this, has been cropped.
const CROPPED: f64 = 0.02;
/// Focal lengths of photos, in their diagonals: from that of a fisheye to that of a telescope.
const PLAUSIBLE: Range<f64> = 0.1..50.0;

/// Bytes of a value of each type, by its number, up to a directory's offset; and the type of text in UTF-8, of one byte each.
const SIZES: [u64; 14] = [0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8, 4];
const UTF8: u16 = 129;
/// The types of whole numbers of 16 and of 32 bit.
const SHORT: u16 = 3;
const LONG: u16 = 4;
const RATIONAL: u16 = 5;
/// Bytes of an entry of a directory.
const ENTRY: usize = 12;

/// The focal length in pixels of a photo that has this size now, upright or not; `None` where the data do not say, or say it of a photo of
/// another shape: then it has been cropped.
///
/// By the 35 mm equivalent, or by the focal length and the pixels of the sensor.
pub fn focal_length(exif: &[u8], (width, height): (usize, usize)) -> Option<f64> {
    let tiff = Tiff::new(exif)?;
    let directory = tiff.long(tiff.entry(tiff.long(4)? as usize, EXIF)? + 8)? as usize;
    let number = |tag| tiff.number(tiff.entry(directory, tag)?).filter(|value| *value > 0.0);
    let taken = number(PIXEL_X_DIMENSION).zip(number(PIXEL_Y_DIMENSION));
    if let Some((x, y)) = taken {
        let ratio = |a: f64, b: f64| a.max(b) / a.min(b);
        if (ratio(x, y) / ratio(width as f64, height as f64) - 1.0).abs() > CROPPED {
            return None;
        }
    }
    let found = match number(FOCAL_LENGTH_IN_35MM_FILM) {
        Some(equivalent) => equivalent / DIAGONAL_OF_35MM_FILM,
        None => {
            let millimetres = match number(FOCAL_PLANE_RESOLUTION_UNIT) {
                None | Some(2.0) => 25.4,
                Some(3.0) => 10.0,
                Some(_) => return None,
            };
            let (x, y) = taken?;
            number(FOCAL_LENGTH)? * number(FOCAL_PLANE_X_RESOLUTION)? / millimetres / diagonal((x as usize, y as usize))
        }
    };
    PLAUSIBLE.contains(&found).then(|| found * diagonal((width, height)))
}

/// The data for an upright picture of this size, without a thumbnail; `None` of damaged data.
pub(super) fn adapted(exif: &[u8], (width, height): (u32, u32)) -> Option<Vec<u8>> {
    let mut tiff = Tiff::new(exif)?;
    let first = tiff.long(4)? as usize;
    let mut end = 0;
    let mut directories = vec![first];
    let mut next = 0;
    while let Some(&directory) = directories.get(next) {
        next += 1;
        let entries = tiff.entries(directory)?;
        // Behind the entries is where the next directory is.
        end = end.max(entries.end + 4);
        for at in entries.step_by(ENTRY) {
            match tiff.short(at)? {
                ORIENTATION => tiff.set(at, SHORT, 1)?,
                IMAGE_WIDTH | PIXEL_X_DIMENSION => tiff.set(at, LONG, width)?,
                IMAGE_LENGTH | PIXEL_Y_DIMENSION => tiff.set(at, LONG, height)?,
                // Four at most, however they point at each other.
                EXIF | GPS | INTEROPERABILITY if directories.len() < 4 => directories.push(tiff.long(at + 8)? as usize),
                _ => {}
            }
            end = end.max(tiff.end_of_value(at)?);
        }
    }
    // The directory after the first one is that of the thumbnail, which mostly lies behind all others.
    tiff.write(tiff.entries(first)?.end, &[0; 4])?;
    (end <= tiff.bytes.len()).then(|| {
        tiff.bytes.truncate(end);
        tiff.bytes
    })
}

/// A copy of the data, in its byte order.
struct Tiff {
    bytes: Vec<u8>,
    big_endian: bool,
}

impl Tiff {
    fn new(exif: &[u8]) -> Option<Self> {
        let big_endian = match exif.get(..4)? {
            b"II*\0" => false,
            b"MM\0*" => true,
            _ => return None,
        };
        Some(Self { bytes: exif.to_vec(), big_endian })
    }

    fn short(&self, at: usize) -> Option<u16> {
        let bytes = *self.bytes.get(at..)?.first_chunk()?;
        Some(if self.big_endian { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) })
    }

    fn long(&self, at: usize) -> Option<u32> {
        let bytes = *self.bytes.get(at..)?.first_chunk()?;
        Some(if self.big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    /// Where the entries of a directory are.
    fn entries(&self, directory: usize) -> Option<Range<usize>> {
        let count = usize::from(self.short(directory)?);
        let first = directory + 2;
        Some(first..first + count * ENTRY)
    }

    /// Where a directory's entry of this tag is.
    fn entry(&self, directory: usize, tag: u16) -> Option<usize> {
        self.entries(directory)?.step_by(ENTRY).find(|at| self.short(*at) == Some(tag))
    }

    /// The value of the entry at `at`, if that is a number.
    fn number(&self, at: usize) -> Option<f64> {
        match self.short(at + 2)? {
            SHORT => self.short(at + 8).map(f64::from),
            LONG => self.long(at + 8).map(f64::from),
            RATIONAL => {
                let value = self.long(at + 8)? as usize;
                Some(f64::from(self.long(value)?) / f64::from(self.long(value.checked_add(4)?)?))
            }
            _ => None,
        }
    }

    fn write(&mut self, at: usize, bytes: &[u8]) -> Option<()> {
        self.bytes.get_mut(at..at.checked_add(bytes.len())?)?.copy_from_slice(bytes);
        Some(())
    }

    /// Makes the entry at `at` one number of this type.
    fn set(&mut self, at: usize, kind: u16, value: u32) -> Option<()> {
        let short = |v: u16| if self.big_endian { v.to_be_bytes() } else { v.to_le_bytes() };
        let long = |v: u32| if self.big_endian { v.to_be_bytes() } else { v.to_le_bytes() };
        let (kind, count) = ((short(kind), kind), long(1));
        let value = match kind.1 {
            SHORT => {
                let [a, b] = short(value as u16);
                [a, b, 0, 0]
            }
            _ => long(value),
        };
        self.write(at + 2, &kind.0)?;
        self.write(at + 4, &count)?;
        self.write(at + 8, &value)
    }

    /// Where the value of the entry at `at` ends; 0 for one in the entry itself.
    fn end_of_value(&self, at: usize) -> Option<usize> {
        let kind = self.short(at + 2)?;
        let size = if kind == UTF8 { 1 } else { *SIZES.get(usize::from(kind))? };
        let bytes = size * u64::from(self.long(at + 4)?);
        if bytes <= 4 {
            return Some(0);
        }
        usize::try_from(bytes + u64::from(self.long(at + 8)?)).ok()
    }
}
