//! What weather, optics and camera do to a photo, done on purpose: how strong may it be before a method
//! fails?
//!
//! The steps follow the way of the light, each on real values, which are rounded once, at the end:
//!
//! 1. `fog`: a veil of one grey over the whole photo. Real fog takes more of what is farther away
//!    (Koschmieder); the depth of a query is not known, so that this is the fog of a scene at one distance;
//! 2. `blur`: a Gaussian, as out of focus;
//! 3. `exposure`: stops of light. Photos are stored with a gamma of about 2.2, so that a stop multiplies
//!    the stored values by 2^(1/2.2); what exceeds white is lost, as on a sensor;
//! 4. `gamma`: another tone curve;
//! 5. `noise`: the same amount everywhere, independent from pixel to pixel;
//! 6. `invert`: the negative;
//! 7. `mirror`: left and right exchanged, a photo of no place at all.
//!
//! Estimators see grey values, which are degraded as grey; the colours of a photo, for display, take the
//! same steps and the same noise.

use std::fmt;
use std::str::FromStr;

use image::imageops::{blur, flip_horizontal_in_place};
use image::{ImageBuffer, Luma, Pixel};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use xxhash_rust::xxh3::xxh3_64;

use super::Photo;
use crate::describe::{Described, Domain, Value, list, parameters, set};

/// The grey of the veil: that of an overcast sky in a daylight photo.
const VEIL: f32 = 204.0;
/// The gamma that photos are stored with.
const STORED_GAMMA: f64 = 2.2;

parameters! {
    /// A degradation of a photo, none by default. Written as `gamma=0.4,noise=8,invert`.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Degradation {
        /// Fog: share of the light that comes from a uniform grey (204) instead of the scene.
        pub fog: f64 = 0.0 => number("fog", "", 0.0..=1.0),
        /// Blur: standard deviation of a Gaussian.
        pub blur_px: f64 = 0.0 => number("blur", "px", 0.0..=20.0),
        /// Exposure: brighter above 0, darker below; values beyond white are clipped.
        pub exposure_stops: f64 = 0.0 => number("exposure", "stops", -8.0..=8.0),
        /// Gamma: exponent of grey values from 0 to 1; below 1 dark parts become brighter, above 1 darker.
        pub gamma: f64 = 1.0 => number("gamma", "", 0.05..=10.0),
        /// Noise: standard deviation of Gaussian noise, seeded by --seed and the query's name.
        pub noise_levels: f64 = 0.0 => number("noise", "grey levels", 0.0..=128.0),
        /// Invert: the negative of the photo.
        pub invert: bool = false => flag("invert"),
        /// Mirror: left and right exchanged; no pose of such a photo is right.
        pub mirror: bool = false => flag("mirror"),
    }
}

/// Why a degradation cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DegradationError {
    /// Nothing is written, or nothing between two commas.
    #[error("STEP=STRENGTH expected, such as gamma=0.4,noise=8,invert; `{0}` found")]
    Empty(String),
    /// A name that is none.
    #[error("`{name}` is not a degradation; {known} expected")]
    Unknown {
        /// The name.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// The same twice.
    #[error("`{0}` is given twice")]
    Twice(String),
    /// A value out of range, or none where one is needed.
    #[error("`{name}` takes {expected}, not `{given}`")]
    BadValue {
        /// What was to be set.
        name: String,
        /// What values it takes, with their unit.
        expected: String,
        /// The value that was given.
        given: String,
    },
}

impl Degradation {
    /// Each step with its present strength, in the order in which they are applied.
    pub fn steps(&self) -> Vec<Described> {
        let mut copy = *self;
        list(&mut copy)
    }

    /// Sets the strength of a step.
    ///
    /// # Errors
    /// An unknown name, or a value that is no strength.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), DegradationError> {
        let steps = self.steps();
        let Some(step) = steps.iter().find(|step| step.key == name) else {
            let known: Vec<&str> = steps.iter().map(|step| step.key.as_str()).collect();
            let (name, known) = (name.to_owned(), known.join(", "));
            return Err(DegradationError::Unknown { name, known });
        };
        match set(self, name, value) {
            Some(Ok(())) => Ok(()),
            _ => Err(DegradationError::BadValue {
                name: name.to_owned(),
                expected: format!("{} {}", step.domain, step.about.unit).trim_end().to_owned(),
                given: value.to_owned(),
            }),
        }
    }

    /// Whether it leaves every photo as it is.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// The photo, degraded. Noise follows from `seed` and `name`, the name of the frame, alone.
    pub fn of(&self, photo: &Photo, seed: u64, name: &str) -> Photo {
        if self.is_none() {
            return photo.clone();
        }
        let (width, height) = photo.dimensions();
        let noise = self.noise(width as usize * height as usize, seed, name);
        Photo {
            gray: self.degraded(&photo.gray, &noise),
            color: (photo.color.as_ref()).map(|color| self.degraded(color, &noise)),
        }
    }

    /// Normal numbers of the noise's deviation, one for each pixel; none where there is no noise.
    fn noise(&self, pixels: usize, seed: u64, name: &str) -> Vec<f32> {
        if self.noise_levels == 0.0 {
            return Vec::new();
        }
        let seed = xxh3_64(format!("{seed}/{name}/degradation noise").as_bytes());
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut noise = Vec::with_capacity(pixels + 1);
        // Box and Muller 1958: two normal numbers from two uniform ones.
        while noise.len() < pixels {
            let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt() * self.noise_levels;
            let (sin, cos) = (std::f64::consts::TAU * rng.random::<f64>()).sin_cos();
            noise.extend([(radius * cos) as f32, (radius * sin) as f32]);
        }
        noise.truncate(pixels);
        noise
    }

    fn degraded<P: Pixel<Subpixel = u8>>(
        &self,
        photo: &ImageBuffer<P, Vec<u8>>,
        noise: &[f32],
    ) -> ImageBuffer<P, Vec<u8>> {
        let fog = self.fog as f32;
        let foggy = |&value: &u8| (1.0 - fog) * f32::from(value) + fog * VEIL;
        let mut values: Vec<f32> = photo.as_raw().iter().map(foggy).collect();
        let channels = usize::from(P::CHANNEL_COUNT);
        if self.blur_px > 0.0 && !values.is_empty() {
            for channel in 0..channels {
                let own = values.iter().skip(channel).step_by(channels).copied();
                let own = of_as_many::<Luma<f32>>(photo.dimensions(), own.collect());
                let smoothed = blur(&own, self.blur_px as f32);
                let own = values.iter_mut().skip(channel).step_by(channels);
                own.zip(smoothed.into_raw()).for_each(|(value, smoothed)| *value = smoothed);
            }
        }
        let gain = (self.exposure_stops / STORED_GAMMA).exp2() as f32;
        let gamma = self.gamma as f32;
        let finished = values.iter().enumerate().map(|(at, &value)| {
            let mut value = (value * gain).clamp(0.0, 255.0);
            if gamma != 1.0 {
                value = 255.0 * (value / 255.0).powf(gamma);
            }
            value += noise.get(at / channels).copied().unwrap_or(0.0);
            let value = value.round().clamp(0.0, 255.0) as u8;
            if self.invert { 255 - value } else { value }
        });
        let mut degraded = of_as_many(photo.dimensions(), finished.collect());
        if self.mirror {
            flip_horizontal_in_place(&mut degraded);
        }
        degraded
    }
}

/// An image of as many values as it has pixels and channels.
fn of_as_many<P: Pixel>(
    (width, height): (u32, u32),
    values: Vec<P::Subpixel>,
) -> ImageBuffer<P, Vec<P::Subpixel>> {
    ImageBuffer::from_raw(width, height, values)
        .unwrap_or_else(|| unreachable!("as many values as the photo has"))
}

/// As it is read: the steps that differ from none.
impl fmt::Display for Degradation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let none = Self::default().steps();
        let mut separator = "";
        for (step, none) in self.steps().iter().zip(none) {
            if step.value == none.value {
                continue;
            }
            match step.value {
                Value::Flag(true) => write!(f, "{separator}{}", step.key)?,
                value => write!(f, "{separator}{}={value}", step.key)?,
            }
            separator = ",";
        }
        Ok(())
    }
}

impl FromStr for Degradation {
    type Err = DegradationError;

    fn from_str(text: &str) -> Result<Self, DegradationError> {
        let mut degradation = Self::default();
        let steps = degradation.steps();
        let mut given: Vec<&str> = Vec::new();
        for part in text.split(',') {
            let (name, value) = match part.split_once('=') {
                Some((name, value)) => (name.trim(), Some(value.trim())),
                None => (part.trim(), None),
            };
            if name.is_empty() {
                return Err(DegradationError::Empty(text.to_owned()));
            }
            if given.contains(&name) {
                return Err(DegradationError::Twice(name.to_owned()));
            }
            given.push(name);
            let step = steps.iter().find(|step| step.key == name);
            // A switch is on where it is named.
            let is_switch = step.is_some_and(|step| step.domain == Domain::Flag);
            let value = value.unwrap_or(if is_switch { "true" } else { "" });
            degradation.set(name, value)?;
        }
        Ok(degradation)
    }
}

crate::serde_as_text!(Degradation);

#[cfg(test)]
mod tests {
    use super::*;
    use image::{GrayImage, Rgb, RgbImage};
    use proptest::prelude::*;

    fn read(text: &str) -> Degradation {
        text.parse().expect("a degradation")
    }

    /// Every grey value once, beside each other.
    fn ramp() -> Photo {
        Photo::from_gray_values(16, 16, (0..=255).collect()).expect("as many")
    }

    fn colored() -> Photo {
        Photo::from_color(RgbImage::from_fn(9, 7, |x, y| {
            Rgb([(20 * x) as u8, (30 * y) as u8, (10 * x + 20 * y) as u8])
        }))
    }

    fn gray(degradation: &str, photo: &Photo) -> Vec<u8> {
        read(degradation).of(photo, 0, "query").gray.into_raw()
    }

    fn degradations() -> impl Strategy<Value = Degradation> {
        let strengths =
            (0.0..=1.0_f64, 0.0..=3.0_f64, -3.0..=3.0_f64, 0.05..=10.0_f64, 0.0..=40.0_f64);
        (strengths, any::<bool>(), any::<bool>()).prop_map(
            |((fog, blur_px, exposure_stops, gamma, noise_levels), invert, mirror)| Degradation {
                fog,
                blur_px,
                exposure_stops,
                gamma,
                noise_levels,
                invert,
                mirror,
            },
        )
    }

    proptest! {
        #[test]
        fn what_is_written_reads_back(degradation in degradations()) {
            prop_assume!(!degradation.is_none());
            prop_assert_eq!(read(&degradation.to_string()), degradation);
        }

        #[test]
        fn the_same_query_and_seed_give_the_same_photo(degradation in degradations(), seed in 0..9_u64) {
            let photo = colored();
            let [one, two] = [(); 2].map(|()| degradation.of(&photo, seed, "a"));
            prop_assert_eq!(one.gray, two.gray);
            prop_assert_eq!(one.color, two.color);
        }

        #[test]
        fn a_greater_gamma_is_darker_and_keeps_the_order(low in 0.05..10.0_f64, more in 0.0..5.0_f64) {
            let high = (low + more).min(10.0);
            let [bright, dark] = [low, high].map(|gamma| gray(&format!("gamma={gamma}"), &ramp()));
            prop_assert!(bright.iter().zip(&dark).all(|(bright, dark)| bright >= dark));
            prop_assert!(bright.is_sorted() && dark.is_sorted());
            prop_assert_eq!((dark[0], dark[255]), (0, 255));
        }

        #[test]
        fn more_light_is_never_darker(low in -8.0..8.0_f64, more in 0.0..5.0_f64) {
            let high = (low + more).min(8.0);
            let [dark, bright] = [low, high].map(|stops| gray(&format!("exposure={stops}"), &ramp()));
            prop_assert!(dark.iter().zip(&bright).all(|(dark, bright)| dark <= bright));
        }
    }

    #[test]
    fn none_leaves_the_photo_as_it_is_and_the_negative_of_the_negative_is_the_photo() {
        let photo = colored();
        for text in ["gamma=1", "noise=0,fog=0", "invert=false,blur=0,exposure=0"] {
            let degradation = read(text);
            assert!(degradation.is_none(), "{text}");
            let same = degradation.of(&photo, 3, "query");
            assert_eq!(same.gray, photo.gray);
            assert_eq!(same.color, photo.color);
        }
        for text in ["invert", "mirror"] {
            let step = read(text);
            let twice = step.of(&step.of(&photo, 0, "a"), 0, "a");
            assert_eq!((twice.gray, twice.color), (photo.gray.clone(), photo.color.clone()));
        }
    }

    #[test]
    fn each_step_does_what_it_says() {
        assert_eq!(gray("gamma=2", &ramp())[128], 64);
        assert_eq!(gray("gamma=0.5", &ramp())[64], 128);
        // 2.2 stops are twice the stored value.
        assert_eq!(gray("exposure=2.2", &ramp())[100], 200);
        assert_eq!(gray("exposure=2.2", &ramp())[200], 255);
        assert_eq!(gray("exposure=-2.2", &ramp())[200], 100);
        assert_eq!(gray("fog=0.5", &ramp())[0], 102);
        assert!(gray("fog=1", &ramp()).iter().all(|&value| value == 204));
        assert_eq!(gray("invert", &ramp())[7], 248);
        assert_eq!(gray("mirror", &ramp())[..3], [15, 14, 13]);
        let flat = Photo::from_gray_values(8, 8, vec![77; 64]).expect("as many");
        assert_eq!(gray("blur=3", &flat), vec![77; 64]);
        let sharp = read("blur=2").of(&ramp(), 0, "a").gray;
        assert!(sharp.get_pixel(0, 0).0[0] > 0 && sharp.get_pixel(15, 15).0[0] < 255);
    }

    #[test]
    fn noise_has_the_deviation_that_was_asked_for_and_is_anothers_for_another_query() {
        let flat = Photo::from_gray_values(200, 100, vec![128; 20_000]).expect("as many");
        let noise = |seed, name| read("noise=8").of(&flat, seed, name).gray.into_raw();
        let values = noise(0, "a");
        let deviations = values.iter().map(|&value| f64::from(value) - 128.0);
        let (mean, square) = deviations.fold((0.0, 0.0), |(mean, square), deviation| {
            (mean + deviation / 2e4, square + deviation * deviation / 2e4)
        });
        assert!(mean.abs() < 0.25, "{mean}");
        assert!((square.sqrt() - 8.0).abs() < 0.2, "{square}");
        assert_ne!(values, noise(0, "b"));
        assert_ne!(values, noise(1, "a"));
    }

    #[test]
    fn colours_take_the_steps_of_the_grey_values() {
        let grey = RgbImage::from_fn(9, 7, |x, y| Rgb([(20 * x + 9 * y) as u8; 3]));
        let degradation = read("fog=0.2,gamma=0.6,noise=12,exposure=0.5,blur=1");
        let photo = degradation.of(&Photo::from_color(grey), 4, "a");
        let color = photo.color.expect("colours stay");
        for (gray, color) in photo.gray.pixels().zip(color.pixels()) {
            let gray = i16::from(gray.0[0]);
            assert!(color.0.iter().all(|&c| (i16::from(c) - gray).abs() <= 1));
        }
    }

    #[test]
    fn bad_text_is_told_what_was_expected() {
        let said = |text: &str| text.parse::<Degradation>().expect_err(text).to_string();
        assert_eq!(
            said("gama=0.4"),
            "`gama` is not a degradation; fog, blur, exposure, gamma, noise, invert, mirror expected"
        );
        assert_eq!(said("gamma=0"), "`gamma` takes 0.05 … 10, not `0`");
        assert_eq!(said("blur=-1"), "`blur` takes 0 … 20 px, not `-1`");
        assert_eq!(said("noise=nan"), "`noise` takes 0 … 128 grey levels, not `nan`");
        assert_eq!(said("noise"), "`noise` takes 0 … 128 grey levels, not ``");
        assert_eq!(said("invert=maybe"), "`invert` takes true | false, not `maybe`");
        assert_eq!(said("fog=0.1,fog=0.2"), "`fog` is given twice");
        for empty in ["", ",", "gamma=1,"] {
            assert!(said(empty).contains("such as gamma=0.4"), "{empty}");
        }
    }

    #[test]
    fn an_image_without_pixels_stays_one() {
        let empty = Photo::from_gray(GrayImage::new(0, 0));
        let degraded = read("blur=2,noise=3,gamma=2").of(&empty, 0, "a");
        assert_eq!(degraded.dimensions(), (0, 0));
    }
}
