//! Tables of canned results, against figures worked out by hand.

use super::super::metrics::tests::row;
use super::*;
use crate::localize::Setting;

fn at(
    row: QueryResult,
    scene: &str,
    radius_m: f64,
    references: usize,
    fusion: Option<&str>,
) -> QueryResult {
    QueryResult {
        scene: scene.to_owned(),
        setting: Some(Setting { radius_m, references }),
        fusion: fusion.map(|name| name.parse().expect("a fusion")),
        ..row
    }
}

fn lines(tables: &[Table], name: &str) -> Vec<String> {
    let table = tables.iter().find(|table| table.name == name);
    let table = table.unwrap_or_else(|| panic!("{name} among {tables:?}"));
    table.rows.iter().map(|row| row.join(" | ")).collect()
}

#[test]
fn the_papers_own_cells_give_the_averages_of_its_abstract() {
    let conditions =
        ["overcast", "sun", "night", "rain", "snow"].map(|name| format!("robotcar/{name}"));
    let pairs: Vec<(&str, &str)> = conditions
        .iter()
        .flat_map(|scene| conditions.iter().map(move |queries| (scene.as_str(), queries.as_str())))
        .collect();
    let rows: Vec<QueryResult> = pairs
        .iter()
        .flat_map(|(scene, queries)| {
            // FB solves none of two, MI one, HY both.
            let solved = [
                ("a", "fb", None),
                ("b", "fb", None),
                ("a", "mi", Some(1.0)),
                ("b", "mi", None),
                ("a", "hy", Some(1.0)),
                ("b", "hy", Some(1.0)),
            ];
            solved.map(|(query, method, error)| QueryResult {
                query_scene: (scene != queries).then(|| (*queries).to_owned()),
                ..at(row(query, method, error), scene, 10.0, 2, Some("r-wavg"))
            })
        })
        .collect();
    let tables = tables(&RunResults::of(rows, 10.0), Some("large"));
    assert_eq!(lines(&tables, "advantage"), ["fb | 25 | 100.0 | 25.1", "mi | 25 | 50.0 | 5.8"]);
}

#[test]
fn the_single_table_has_medians_over_queries_solved_by_all_and_the_papers_figures() {
    // At 10 m both solve a and b. At 15 m fb reports no pose of a; mi is 20 m off on b, which is no
    // success and yet a query that both report as solved.
    let results = [
        ("a", 10.0, Some(0.1), Some(2.0)),
        ("b", 10.0, Some(0.3), Some(4.0)),
        ("a", 15.0, None, Some(1.0)),
        ("b", 15.0, Some(0.5), Some(20.0)),
    ];
    let rows: Vec<QueryResult> = results
        .iter()
        .flat_map(|(query, radius, fb, mi)| {
            [("fb", fb), ("mi", mi)]
                .map(|(method, error)| at(row(query, method, *error), "kitti/00", *radius, 1, None))
        })
        .collect();
    let tables = tables(&RunResults::of(rows, 10.0), Some("single"));
    assert_eq!(
        lines(&tables, "single-translation-kitti-00"),
        [
            "solved by all | 2 | 1",
            "solved by all (paper) | 406 | 328",
            "solved by all (%) | 100.0 | 50.0",
            "solved by all (%) (paper) | 89 | 72",
            "fb | 0.200 | 0.500",
            "fb (paper) | 0.13 | 0.40",
            "mi | 3.000 | 20.000",
            "mi (paper) | 1.56 | 5.41",
        ]
    );
    // The greatest Euler angle of the canned errors is half of their metres.
    let rotation = lines(&tables, "single-rotation-kitti-00");
    assert_eq!(rotation[4], "fb | 0.100 | 0.250");
    assert_eq!(rotation[5], "fb (paper) | 1.76 | 3.83");
    let solved = [
        "fb (solved) | 100.0 | 50.0",
        "fb (success) | 100.0 | 50.0",
        "mi (solved) | 100.0 | 100.0",
        "mi (success) | 100.0 | 50.0",
    ];
    assert_eq!(lines(&tables, "single-solved-kitti-00"), solved);
    // Failures are infinite: half of the queries at 15 m is within no limit for fb.
    assert!(lines(&tables, "summary")[2].ends_with("| 0.0 | 50.0 | 50.0"));
}

#[test]
fn the_multi_table_has_the_rmse_over_all_queries_that_each_fusion_solved() {
    // 17 m is no success, and counts: the table is over what the method reports as solved.
    let mut rows = Vec::new();
    for (query, one, avg, robust) in
        [("a", Some(3.0), Some(7.0), Some(0.6)), ("b", None, Some(17.0), Some(0.8))]
    {
        for method in ["fb", "mi"] {
            for (count, fusion, error) in
                [(1, "avg", one), (1, "r-wavg", one), (2, "avg", avg), (2, "r-wavg", robust)]
            {
                rows.push(at(row(query, method, error), "street", 10.0, count, Some(fusion)));
            }
        }
    }
    let tables = tables(&RunResults::of(rows, 10.0), Some("multi"));
    // √((49 + 289)/2) = 13, √((0.36 + 0.64)/2) = 0.707; angles are half of that.
    assert_eq!(
        lines(&tables, "multi-rmse-street")[..4],
        [
            "fb | avg | 3.000 | 1.500 | 13.000 | 6.500",
            "fb | avg (median) | 3.000 | 1.500 | 12.000 | 6.000",
            "fb | r-wavg | 3.000 | 1.500 | 0.707 | 0.354",
            "fb | r-wavg (median) | 3.000 | 1.500 | 0.700 | 0.350",
        ]
    );
    let solved = lines(&tables, "multi-solved-street");
    assert_eq!(
        solved[..2],
        ["fb | avg (solved) | 50.0 | 100.0", "fb | avg (success) | 50.0 | 50.0"]
    );
}

#[test]
fn the_large_table_and_the_confusion_matrix_place_every_pair() {
    let with_rain = |row: QueryResult| QueryResult { query_scene: Some("rain".to_owned()), ..row };
    let fused = |row: QueryResult| at(row, "kitti/01", 10.0, 2, Some("r-wavg"));
    let rows = vec![
        fused(row("a", "fb", Some(3.0))),
        fused(row("a", "mi", Some(4.0))),
        fused(with_rain(row("a", "fb", None))),
        fused(with_rain(row("a", "mi", Some(6.0)))),
    ];
    let tables = tables(&RunResults::of(rows, 10.0), Some("large"));
    assert_eq!(
        lines(&tables, "large"),
        [
            "kitti/01 | fb | 1 | 100.0 | 3.000 | 1.500 | 3.000 | 1.500 | 84.5 | 0.494 | 0.567",
            "kitti/01 | mi | 1 | 100.0 | 4.000 | 2.000 | 4.000 | 2.000 | 60.0 | 0.980 | 0.353",
            "kitti/01 ← rain | fb | 1 | 0.0 | – | – | – | – | – | – | –",
            "kitti/01 ← rain | mi | 1 | 100.0 | 6.000 | 3.000 | 6.000 | 3.000 | – | – | –",
        ]
    );
    assert_eq!(
        lines(&tables, "confusion"),
        [
            "kitti/01 | fb | 100.0 | 3.000 | 1.500 | 0.0 | – | –",
            "kitti/01 | mi | 100.0 | 4.000 | 2.000 | 100.0 | 6.000 | 3.000",
        ]
    );
}

#[test]
fn the_large_table_has_no_columns_for_figures_that_the_paper_does_not_have() {
    let rows = vec![at(row("a", "fb", Some(3.0)), "street", 10.0, 2, Some("r-wavg"))];
    let tables = tables(&RunResults::of(rows, 10.0), Some("large"));
    assert_eq!(
        lines(&tables, "large"),
        ["street | fb | 1 | 100.0 | 3.000 | 1.500 | 3.000 | 1.500"]
    );
    assert!(tables.iter().all(|table| !table.to_markdown().contains("paper")));
}

#[test]
fn every_shape_names_figures_that_there_are() {
    let shapes = SHAPES.as_ref().expect("the file of shapes");
    let one = RunResults::of(vec![row("a", "fb", Some(1.0))], 10.0);
    for shape in &shapes.table {
        for name in shape.first.iter().chain(shape.figures.iter().flatten()) {
            assert!(shapes.figures.contains_key(name), "{name} of {}", shape.name);
        }
    }
    // Where chance has no radius it has no figure.
    let unknown = shapes.figures.keys().filter(|name| one.measures[0].figure(name).is_none());
    assert!(unknown.eq(["chance_random", "chance_reference", "median(time)"]));
    for table in TableName::value_variants() {
        let is_empty = [TableName::Verdicts, TableName::Rivals].contains(table);
        assert_eq!(table.of(&one).is_empty(), is_empty, "{table:?}");
    }
}
