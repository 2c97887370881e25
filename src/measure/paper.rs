//! The figures of the paper, for comparison with ours.
//!
//! Fu, Pertuz, Matas, Kämäräinen, *Performance Analysis and Robustification of Single-query 6-DoF
//! Camera Pose Estimation*, CVIU 2019, tables 1 to 6. In table 6 the rows are taken as references and
//! the columns as queries.

use std::borrow::Cow;
use std::sync::LazyLock;

use super::metrics::Group;
use crate::table::Table;

/// A line of `table,scene,query_scene,method,radius_m,references,fusion,measure,value`. An empty query scene means
/// that of the references. Other empty fields match any value.
type Figure = Vec<&'static str>;

static ALL: LazyLock<Vec<Figure>> = LazyLock::new(|| {
    let lines = include_str!("../../assets/paper.csv").lines().skip(1);
    let figures = lines.map(|line| line.split(',').collect::<Figure>());
    figures.filter(|figure| figure.len() == 9).collect()
});

/// Traversals of RobotCar by the condition that they were driven in. The paper names conditions, and no traversals.
static TRAVERSALS: LazyLock<Vec<(&'static str, &'static str)>> = LazyLock::new(|| {
    let lines = include_str!("../../assets/robotcar.csv").lines().skip(1);
    lines.filter_map(|line| line.split_once(',')).collect()
});

/// The paper's name of a scene: that of a RobotCar traversal is its condition.
fn name(scene: &str) -> Cow<'_, str> {
    let date = scene.strip_prefix("robotcar/");
    let known = date.and_then(|date| TRAVERSALS.iter().find(|(traversal, _)| *traversal == date));
    known.map_or(Cow::Borrowed(scene), |(_, condition)| format!("robotcar/{condition}").into())
}

/// The paper's figure for a group and method, from the first of these tables that has it. `measure` is `median_m`,
/// `median_deg`, `rmse_m`, `rmse_deg`, `success_percent`, `common` or `common_percent`.
pub fn figure(tables: &[u8], group: &Group, method: &str, measure: &str) -> Option<&'static str> {
    let setting = group.setting;
    let keys = [
        Some(method.to_owned()),
        setting.map(|setting| setting.radius_m.to_string()),
        setting.map(|setting| setting.references.to_string()),
        group.fusion.map(|fusion| fusion.to_string()),
    ];
    let is_its = |fields: &[&str]| {
        let same = |(field, key): (&&str, &Option<String>)| {
            field.is_empty() || key.as_deref() == Some(*field)
        };
        fields[1] == name(&group.scene)
            && fields[2] == group.query_scene.as_deref().map(name).unwrap_or_default()
            && fields[3..7].iter().zip(&keys).all(same)
            && fields[7] == measure
    };
    tables.iter().find_map(|number| {
        let number = number.to_string();
        let mut figures = ALL.iter().filter(|figure| figure[0] == number);
        figures.find(|figure| is_its(figure)).map(|figure| figure[8])
    })
}

/// A scene in the paper's tables 1 and 2: number of images, tag, length \[km\] and mean distance of consecutive
/// images \[m\].
pub fn scene(scene: &str) -> Option<[&'static str; 4]> {
    let name = name(scene);
    let find = |measure| {
        let of_scene = |figure: &&Figure| figure[0] <= "2" && figure[1] == name;
        let mut figures = ALL.iter().filter(of_scene);
        figures.find(|figure| figure[7] == measure).map(|figure| figure[8])
    };
    Some([find("images")?, find("tag")?, find("length_km")?, find("spacing_m")?])
}

/// The paper's table 1 or 2.
pub fn scenes(number: u8) -> Table {
    let header = ["scene", "images", "tag", "length (km)", "mean distance between images (m)"];
    let mut table = Table::new(format!("scenes-{number}"), "Scenes of the paper", header);
    let number = number.to_string();
    let of_table = ALL.iter().filter(|figure| figure[0] == number);
    let names = of_table.filter(|figure| figure[7] == "images");
    for name in names.map(|figure| figure[1]) {
        let figures = scene(name).unwrap_or_default();
        table.push([name].into_iter().chain(figures));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::localize::Setting;

    fn group(scene: &str, queries: Option<&str>, setting: (f64, usize), fusion: &str) -> Group {
        Group {
            scene: scene.to_owned(),
            query_scene: queries.map(str::to_owned),
            setting: Some(Setting { radius_m: setting.0, references: setting.1 }),
            fusion: fusion.parse().ok(),
        }
    }

    #[test]
    fn figures_are_found_where_the_paper_has_them_and_nowhere_else() {
        let single = group("kitti/00", None, (25.0, 1), "");
        assert_eq!(figure(&[3], &single, "pm", "median_m"), Some("14.85"));
        let multi = group("kitti/00", None, (10.0, 5), "r-wavg");
        assert_eq!(figure(&[4], &multi, "fb", "rmse_m"), Some("0.045"));
        let large = group("robotcar/night", Some("robotcar/rain"), (10.0, 2), "r-wavg");
        let found = figure(&[5, 6], &large, "hy", "success_percent");
        assert_eq!(found, Some("37.6"));
        let street = group("street", None, (25.0, 1), "");
        assert_eq!(figure(&[3], &street, "pm", "median_m"), None);
        let by_date = group(
            "robotcar/2014-12-10-18-10-50",
            Some("robotcar/2014-11-25-09-18-32"),
            (10.0, 2),
            "r-wavg",
        );
        assert_eq!(figure(&[6], &by_date, "hy", "success_percent"), Some("37.6"));
        assert_eq!(scene("kitti/04"), Some(["271", "urban", "0.4", "1.5"]));
        assert_eq!(scene("robotcar/2015-02-03-08-45-10"), scene("robotcar/snow"));
        assert_eq!(scene("street"), None);
        assert_eq!(scenes(2).rows.len(), 5);
    }

    #[test]
    fn every_figure_of_the_file_is_a_number() {
        assert_eq!(ALL.len(), 616 + 4 * (11 + 5));
        let mut values = ALL.iter().filter(|figure| figure[7] != "tag").map(|figure| figure[8]);
        assert!(values.all(|value| value.parse::<f64>().is_ok()));
    }
}
