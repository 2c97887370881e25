//! What proves a verdict: the kinds of picture.

/// The kind of picture that proves a verdict. Plain data: what draws it matches every kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Proof {
    /// The cost map with truth and result, the query, and the map seen from both poses.
    CostMap(MapOverlay),
    /// Synthetic views at the result, before and after the frozen freedoms are freed.
    FreedViews,
    /// Both photos with true matches and inliers alone, and the counts of the funnel.
    Matches,
    /// The depths around a match whose depth is wrong.
    DepthPatch,
    /// The inliers in the photo and in space.
    InlierSpread,
    /// The inliers at the pose near the truth beside those at the result.
    RivalInliers,
    /// The cloud on the photo.
    CloudOnPhoto,
    /// Poses on a map: reference, truth, result, and those of each reference of a fusion.
    PoseMap,
    /// The ranked references, the right place marked.
    Ranking,
    /// The map seen from another system's pose and from posescope's own, and which parts of the photo prefer which.
    BothPoses,
    /// The picture of the stage that decided.
    DecidingStage,
}

/// What is drawn into a cost map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MapOverlay {
    /// Cells as ranked, and the cost on the line between truth and result.
    Ranks,
    /// The parts of the query that speak for each pose.
    Preference,
    /// The photos of query and reference, whose light differs.
    Light,
    /// How much each pose covers.
    Coverage,
    /// The area that is searched.
    Reach,
    /// The rim of the grid.
    Rim,
    /// One flat colour and its histogram.
    Flat,
}
