//! The EXIF data of a photo: focal length and orientation.

use std::io::BufReader;
use std::path::Path;

use exif::{In, Tag, Value};
use image::metadata::Orientation;
use posescope_core::files;

/// The diagonal of 35 mm film, to which the equivalent focal length refers (CIPA DCG-001) \[mm\].
const FILM_DIAGONAL_MM: f64 = 43.266_615;

/// The tags of a file; `None` if it has no readable EXIF data.
pub(super) struct Exif(Option<exif::Exif>);

impl Exif {
    pub fn read(path: &Path) -> Self {
        let file = files::open(path).ok();
        let read = |file| exif::Reader::new().read_from_container(&mut BufReader::new(file));
        Self(file.and_then(|file| read(file).ok()))
    }

    fn number(&self, tag: Tag) -> Option<f64> {
        let field = self.0.as_ref()?.get_field(tag, In::PRIMARY)?;
        let number = match &field.value {
            Value::Rational(values) => values.first()?.to_f64(),
            value => f64::from(value.get_uint(0)?),
        };
        (number.is_finite() && number > 0.0).then_some(number)
    }

    /// How to rotate the image upright.
    pub fn orientation(&self) -> Orientation {
        let number = self.number(Tag::Orientation).map(|number| number as u8);
        let turned = number.and_then(Orientation::from_exif);
        turned.unwrap_or(Orientation::NoTransforms)
    }

    /// The focal length \[px\] in an image of a size \[px\], and its source as text.
    ///
    /// From the pixel density of the sensor if given, otherwise from the equivalent focal length on 35 mm film, whose
    /// diagonal corresponds to that of the image.
    pub fn focal_px(&self, (width, height): (u32, u32)) -> Option<(f64, String)> {
        let by_sensor = || {
            let focal_mm = self.number(Tag::FocalLength)?;
            let density = self.number(Tag::FocalPlaneXResolution)?;
            let unit_mm =
                match self.number(Tag::FocalPlaneResolutionUnit).map_or(2, |unit| unit as u8) {
                    3 => 10.0,
                    4 => 1.0,
                    5 => 1e-3,
                    _ => 25.4,
                };
            // The density refers to the original image, which may have been larger.
            let written = self.number(Tag::PixelXDimension).unwrap_or(f64::from(width));
            let focal_px = focal_mm * density / unit_mm * f64::from(width) / written;
            Some((focal_px, format!("{focal_mm:.1} mm on its sensor")))
        };
        let by_film = || {
            let film_mm = self.number(Tag::FocalLengthIn35mmFilm)?;
            let diagonal = f64::from(width).hypot(f64::from(height));
            let focal_px = film_mm * diagonal / FILM_DIAGONAL_MM;
            Some((focal_px, format!("{film_mm:.0} mm on 35 mm film")))
        };
        // Lenses have fields of view from a third of a degree to 170°.
        let is_lens = |(focal_px, _): &(f64, String)| {
            let across = f64::from(width.max(height));
            (0.04 * across..200.0 * across).contains(focal_px)
        };
        by_sensor().filter(is_lens).or_else(|| by_film().filter(is_lens))
    }
}
