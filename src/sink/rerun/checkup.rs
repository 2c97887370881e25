//! The recording of `doctor`: frames with their clouds, to see whether they fit together.

use std::sync::Arc;

use rerun::{Points2D, Radius, ViewCoordinates};

use super::encode::jpeg;
use super::scene::{self, Origin};
use super::stream::Stream;
use super::{Identity, RecordError, Targets, entities};
use crate::palette;
use crate::picture;
use crate::problem::ReferenceTuple;
use crate::render::{RenderParams, color_cloud};

/// Records frames of a scene: camera, photo and cloud in the world, and the cloud on the photo.
///
/// # Errors
/// [`RecordError`].
pub fn record_checkup(
    targets: &Targets,
    scene: &str,
    frames: &[Arc<ReferenceTuple>],
) -> Result<(), RecordError> {
    let identity = Identity {
        scene: scene.to_owned(),
        references: frames.iter().map(|frame| frame.name().to_owned()).collect(),
        ..Identity::default()
    };
    let mut stream = Stream::open(targets, &identity)?;
    stream.log_static(entities::WORLD, &ViewCoordinates::RDF());
    let first = frames.first().map(|frame| frame.world_from_camera().translation.vector);
    let origin = Origin(first.unwrap_or_default());
    for (index, tuple) in frames.iter().enumerate() {
        stream.set_query(index);
        stream.advance();
        let photo = || jpeg(&picture::photo(tuple.photo()));
        stream.log_image("check/photo", photo());
        scene::log_reference(&mut stream, index, tuple, tuple.name(), photo(), origin);
        let params = RenderParams::default();
        let colored = color_cloud(tuple.cloud(), &tuple.photo().gray, tuple.intrinsics(), &params);
        scene::log_cloud(&mut stream, index, tuple, &colored, origin);
        let seen = tuple.cloud().points.iter().filter_map(|point| {
            let pixel = tuple.intrinsics().project(&point.cast())?;
            let is_in_view = tuple.intrinsics().contains(&pixel);
            is_in_view.then_some((pixel, f64::from(point.z)))
        });
        let (places, colors): (Vec<[f32; 2]>, Vec<rerun::Color>) = seen
            .map(|(pixel, depth_m)| {
                // Rerun counts pixels from the corner of the first.
                let place = [pixel.x as f32 + 0.5, pixel.y as f32 + 0.5];
                let near = 1.0 - (depth_m.max(1.0).ln() / 80.0_f64.ln()).min(1.0);
                (place, super::color(palette::viridis(near)))
            })
            .unzip();
        let points =
            Points2D::new(places).with_colors(colors).with_radii([Radius::new_ui_points(1.2)]);
        stream.log("check/photo/cloud", &points);
        stream.flush();
    }
    stream.close()
}
