//! The figures that the paper reports, to stand beside ours.
//!
//! Fu, Pertuz, Matas, Kämäräinen, *Performance Analysis and Robustification of Single-query 6-DoF
//! Camera Pose Estimation*, CVIU 2019, tables 1 to 6. In table 6 the rows are taken as references and
//! the columns as queries.

use std::sync::LazyLock;

/// `table,scene,query_scene,method,radius_m,references,fusion,measure,value`.
const FIGURES: &str = include_str!("../../assets/paper.csv");

struct PaperFigure {
    key: String,
    value: f64,
}

static ALL: LazyLock<Vec<PaperFigure>> = LazyLock::new(|| {
    let lines = FIGURES.lines().skip(1);
    lines
        .filter_map(|line| {
            let (key, value) = line.rsplit_once(',')?;
            Some(PaperFigure {
                key: key.to_owned(),
                value: value.parse().ok()?,
            })
        })
        .collect()
});

/// What a figure of the paper is found by.
#[derive(Clone, Copy, Debug)]
pub struct FigureKey<'a> {
    /// The table's number in the paper, 1 to 6.
    pub table: u8,
    /// The references' scene.
    pub scene: &'a str,
    /// The queries' scene, where it is another one.
    pub query_scene: Option<&'a str>,
    /// The method; empty for figures about all of them.
    pub method: &'a str,
    /// The uncertainty radius \[m\], where the table says it.
    pub radius_m: Option<f64>,
    /// Number of references; 1 where the table is about none.
    pub references: usize,
    /// The fusion.
    pub fusion: Option<&'a str>,
    /// `median_m`, `median_deg`, `rmse_m`, `rmse_deg`, `success_percent`, `common`, `common_percent`,
    /// and in tables 1 and 2 `images`, `length_km`, `spacing_m`.
    pub measure: &'a str,
}

/// The figure, if the paper has it for this scene.
pub fn figure(key: &FigureKey<'_>) -> Option<f64> {
    let radius = key.radius_m.map(|radius| radius.to_string());
    let key = format!(
        "{},{},{},{},{},{},{},{}",
        key.table,
        key.scene,
        key.query_scene.unwrap_or_default(),
        key.method,
        radius.unwrap_or_default(),
        key.references,
        key.fusion.unwrap_or_default(),
        key.measure
    );
    ALL.iter()
        .find(|figure| figure.key == key)
        .map(|figure| figure.value)
}

/// Whether the paper has any figure for these scenes of references and queries.
#[cfg(feature = "cli")]
pub fn has_scene(scene: &str, query_scene: Option<&str>) -> bool {
    ALL.iter().any(|figure| {
        let mut fields = figure.key.split(',').skip(1);
        fields.next() == Some(scene) && fields.next() == Some(query_scene.unwrap_or_default())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_found_where_the_paper_has_them_and_nowhere_else() {
        let single = FigureKey {
            table: 3,
            scene: "kitti/00",
            query_scene: None,
            method: "pm",
            radius_m: Some(25.0),
            references: 1,
            fusion: None,
            measure: "median_m",
        };
        assert_eq!(figure(&single), Some(14.85));
        let multi = FigureKey {
            table: 4,
            method: "fb",
            radius_m: Some(10.0),
            references: 5,
            fusion: Some("r-wavg"),
            measure: "rmse_m",
            ..single
        };
        assert_eq!(figure(&multi), Some(0.045));
        let large = FigureKey {
            table: 6,
            scene: "robotcar/night",
            query_scene: Some("robotcar/rain"),
            method: "hy",
            radius_m: None,
            measure: "success_percent",
            ..multi
        };
        assert_eq!(figure(&large), Some(37.6));
        assert_eq!(
            figure(&FigureKey {
                scene: "street",
                ..single
            }),
            None
        );
    }

    #[test]
    fn every_figure_of_the_file_is_a_number() {
        assert_eq!(ALL.len(), FIGURES.lines().count() - 1);
        assert_eq!(ALL.len(), 616 + 3 * (11 + 5));
    }
}
