//! Where the photos and the panel about one feature are.

use egui::{Rect, Vec2, pos2, vec2};

use crate::app::views::canvas::{PanZoom, Placement};

/// Between the photos, so that lines can be seen apart \[points\].
const GAP: f32 = 24.0;
/// Side of a patch on the screen \[points\].
pub(super) const PATCH: f32 = 132.0;
/// Width of the panel beside the photos: two patches \[points\].
const PANEL_WIDTH: f32 = 2.0 * PATCH + 16.0;
/// Height of the panel below the photos, with its words beside the patches \[points\].
const PANEL_HEIGHT: f32 = PATCH + 46.0;
/// Height with the words below the patches \[points\].
const TALL_PANEL_HEIGHT: f32 = PANEL_HEIGHT + 150.0;
/// Below this width words have no room beside the patches \[points\].
const NARROW: f32 = 560.0;

/// Two photos above or beside each other. Each keeps to the side where the other one is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::app::views) struct Arrangement {
    areas: [Rect; 2],
    aligns: [Vec2; 2],
}

impl Arrangement {
    /// The arrangement that shows photos of these sizes \[px\] larger.
    pub(in crate::app::views) fn new(area: Rect, query: Vec2, reference: Vec2) -> Self {
        let free = (area.size() - Vec2::splat(GAP)).max(Vec2::splat(1.0));
        let wider = query.x.max(reference.x);
        let higher = query.y.max(reference.y);
        let stacked = (area.width() / wider).min(free.y / (query.y + reference.y));
        let abreast = (free.x / (query.x + reference.x)).min(area.height() / higher);
        if stacked >= abreast {
            let end = area.top() + free.y * query.y / (query.y + reference.y);
            let begin = pos2(area.left(), (end + GAP).min(area.bottom()));
            Self {
                areas: [area.with_max_y(end), Rect::from_min_max(begin, area.max)],
                aligns: [vec2(0.5, 1.0), vec2(0.5, 0.0)],
            }
        } else {
            let end = area.left() + free.x * query.x / (query.x + reference.x);
            let begin = pos2((end + GAP).min(area.right()), area.top());
            Self {
                areas: [area.with_max_x(end), Rect::from_min_max(begin, area.max)],
                aligns: [vec2(1.0, 0.5), vec2(0.0, 0.5)],
            }
        }
    }

    /// Where the query (0) or the reference (1) is, zoomed and dragged.
    pub(in crate::app::views) fn place(
        &self,
        photo: usize,
        pan_zoom: &PanZoom,
        size: Vec2,
    ) -> Placement {
        pan_zoom.place(self.areas[photo], size, self.aligns[photo])
    }
}

/// Where the panel about one feature is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DetailPanel {
    pub(super) area: Rect,
    /// Whether its words are beside the patches, not below them.
    pub(super) is_wide: bool,
}

/// The part for the photos and that for the panel: the panel goes below or beside the photos, where
/// it leaves them larger.
pub(super) fn split(area: Rect, query: Vec2, reference: Vec2) -> (Rect, DetailPanel) {
    let is_wide = area.width() >= NARROW;
    let wanted = if is_wide {
        PANEL_HEIGHT
    } else {
        TALL_PANEL_HEIGHT
    };
    let height = wanted.min(0.6 * area.height());
    let below = area.split_top_bottom_at_y(area.bottom() - height);
    let beside = area.split_left_right_at_x(area.right() - PANEL_WIDTH.min(0.6 * area.width()));
    let size = |photos: Rect| {
        let arrangement = Arrangement::new(photos, query, reference);
        arrangement.place(0, &PanZoom::default(), query).scale
    };
    const MARGIN: f32 = 6.0;
    if size(below.0) >= size(beside.0) {
        let area = below.1.with_min_y(below.1.top() + MARGIN);
        (below.0, DetailPanel { area, is_wide })
    } else {
        let area = beside.1.with_min_x(beside.1.left() + MARGIN);
        let panel = DetailPanel {
            area,
            is_wide: false,
        };
        (beside.0, panel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KITTI: Vec2 = vec2(1241.0, 376.0);

    fn area(width: f32, height: f32) -> Rect {
        Rect::from_min_size(pos2(5.0, 7.0), vec2(width, height))
    }

    #[test]
    fn wide_photos_are_stacked_in_a_square_and_abreast_in_a_band() {
        let place = |area: Rect| {
            let arrangement = Arrangement::new(area, KITTI, KITTI);
            [0, 1].map(|photo| {
                arrangement
                    .place(photo, &PanZoom::default(), KITTI)
                    .visible()
            })
        };
        let [query, reference] = place(area(700.0, 700.0));
        assert!((query.width() - 700.0).abs() < 1e-2);
        assert!((reference.top() - query.bottom() - GAP).abs() < 1e-2);
        let [query, reference] = place(area(1400.0, 200.0));
        assert!((query.height() - 200.0).abs() < 1e-2);
        assert!((reference.left() - query.right() - GAP).abs() < 1e-2);
    }

    #[test]
    fn the_panel_goes_where_it_leaves_the_photos_larger() {
        let (photos, panel) = split(area(700.0, 800.0), KITTI, KITTI);
        assert!(panel.area.top() > photos.bottom() && panel.is_wide);
        let (photos, panel) = split(area(1300.0, 500.0), KITTI, KITTI);
        assert!(panel.area.left() > photos.right() && !panel.is_wide);
    }

    #[test]
    fn an_area_without_room_is_no_trouble() {
        let (photos, _) = split(area(0.0, 0.0), KITTI, KITTI);
        let arrangement = Arrangement::new(photos, KITTI, KITTI);
        let at = arrangement.place(1, &PanZoom::default(), KITTI);
        assert!(at.scale.is_finite() && at.visible().min.x.is_finite());
    }
}
