//! Records a fusion: weights, dropped references, and the pose of each reference alone.

use rerun::{BarChart, Points3D, TextDocument};

use super::entities;
use super::scene::Origin;
use super::stream::Stream;
use crate::event::ReferencesFused;
use crate::fusion::ShareOutcome;
use crate::method::Method;
use crate::palette;

/// Records one fusion of a method's poses, and adds its table to those of the query.
pub(super) fn tell(
    event: &ReferencesFused,
    method: Method,
    origin: Origin,
    tables: &mut String,
    stream: &mut Stream,
) {
    let weights = event.shares.iter().map(|share| share.weight);
    let chart = BarChart::new(weights.collect::<Vec<f64>>());
    stream.log(&entities::fusion_weights(method), &chart);
    *tables += &table(event, method);
    let document = TextDocument::from_markdown(tables.as_str());
    stream.log(entities::FUSION_TABLE, &document);
    stream.log(&entities::fusion_candidates(method), &candidates(event, origin));
}

/// The query's position by each reference alone.
fn candidates(event: &ReferencesFused, origin: Origin) -> Points3D {
    let placed = || event.shares.iter().filter_map(|share| Some((share, share.pose?)));
    Points3D::new(placed().map(|(_, pose)| origin.place(&pose.translation.vector)))
        .with_colors(placed().map(|(share, _)| {
            super::color(match share.outcome {
                ShareOutcome::Kept => palette::ESTIMATE,
                ShareOutcome::Dropped
                | ShareOutcome::Failed
                | ShareOutcome::FallbackUnneeded
                | ShareOutcome::Unsupportive
                | ShareOutcome::Outvoted => palette::UNDECIDED,
            })
        }))
        .with_radii([rerun::Radius::new_ui_points(4.0)])
        .with_labels(placed().map(|(share, _)| format!("{} {}", share.reference, share.words())))
        .with_show_labels(false)
}

fn table(event: &ReferencesFused, method: Method) -> String {
    let mut text = format!(
        "## {} by {}\n\n| reference | matches | weight | alone |\n|:--|--:|--:|:--|\n",
        method.name().to_uppercase(),
        event.fusion
    );
    for share in event.shares.iter() {
        let alone = match (&share.pose, &event.pose) {
            (None, _) => "no pose".to_owned(),
            (Some(_), None) => "a pose".to_owned(),
            (Some(alone), Some(fused)) => {
                let offset = alone.translation.vector - fused.translation.vector;
                format!("{:.2} m from the fused pose", offset.norm())
            }
        };
        let support = share.support.map(|support| format!("; {}", support.words()));
        text += &format!(
            "| {} | {} | {} | {alone}{} |\n",
            share.reference,
            share.matches,
            share.words(),
            support.unwrap_or_default()
        );
    }
    let is_joint = event.shares.iter().any(|share| share.support.is_some());
    if event.pose.is_none() {
        text += if is_joint {
            "\nThe references together give no pose.\n"
        } else {
            "\nNo reference with a weight gives a pose.\n"
        };
    }
    text + "\n"
}
