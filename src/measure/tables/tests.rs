//! Tables of canned results, against figures worked out by hand.

use super::super::metrics::{Row, measure, tests::row};
use super::*;
use crate::localize::{Selection, Setting};
use crate::run::{Protocol, QueryCamera, RUN_SCHEMA};

fn fusion(name: &str) -> Fusion {
    name.parse().expect("a fusion")
}

pub(in crate::measure) fn run(experiment: Experiment, scenes: &[(&str, &str)]) -> RunFile {
    let names = |of: fn(&(&str, &str)) -> String| scenes.iter().map(of).collect::<Vec<_>>();
    RunFile {
        schema: RUN_SCHEMA.to_owned(),
        version: "0".to_owned(),
        scenes: names(|pair| pair.0.to_owned()),
        queries: names(|pair| pair.1.to_owned()),
        format: None,
        experiment: Some(experiment),
        protocol: Protocol {
            methods: vec![Method::FB, Method::MI],
            references: match experiment {
                Experiment::Single => Selection::Random(1),
                Experiment::Multi | Experiment::Large => Selection::Random(2),
            },
            fusions: match experiment {
                Experiment::Single => Vec::new(),
                Experiment::Multi => vec![fusion("avg"), fusion("r-wavg")],
                Experiment::Large => vec![fusion("r-wavg")],
            },
            prior_m: (experiment == Experiment::Large).then_some(200.0),
            ..Protocol::default()
        },
        radii_m: if experiment == Experiment::Single {
            vec![10.0, 15.0]
        } else {
            vec![10.0]
        },
        share: 0.1,
        limit: None,
        failure_radius_m: 10.0,
        shard: None,
        inputs: std::collections::BTreeMap::new(),
        pairs: scenes
            .iter()
            .map(|(scene, query_scene)| ScenePair {
                scene_index: 0,
                scene: (*scene).to_owned(),
                query_scene: (*query_scene).to_owned(),
                camera: QueryCamera {
                    width: 1,
                    height: 1,
                    fx: 1.0,
                    fy: 1.0,
                    cx: 0.0,
                    cy: 0.0,
                },
                cameras: Vec::new(),
                drawn: Vec::new(),
                queries: Vec::new(),
                times_s: Vec::new(),
            })
            .collect(),
        params: toml::Table::new(),
    }
}

fn at(row: Row, scene: &str, radius_m: f64, references: usize, fusion: Option<&str>) -> Row {
    Row {
        scene: scene.to_owned(),
        setting: Some(Setting {
            radius_m,
            references,
        }),
        fusion: fusion.map(self::fusion),
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
        .flat_map(|scene| {
            conditions
                .iter()
                .map(move |queries| (scene.as_str(), queries.as_str()))
        })
        .collect();
    let mut run = run(Experiment::Large, &pairs);
    run.protocol.methods = Method::PAPER.to_vec();
    let rows: Vec<Row> = pairs
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
            solved.map(|(query, method, error)| Row {
                query_scene: (scene != queries).then(|| (*queries).to_owned()),
                ..at(row(query, method, error), scene, 10.0, 2, Some("r-wavg"))
            })
        })
        .collect();
    let tables = tables(&run, &measure(&rows, 10.0));
    assert_eq!(
        lines(&tables, "advantage"),
        [
            "FB | 25 | 100.0 | 25.1",
            "PM | 0 | – | 16.8",
            "MI | 25 | 50.0 | 5.8"
        ]
    );
}

#[test]
fn the_single_table_has_medians_over_queries_solved_by_all_and_the_papers_figures() {
    let run = run(Experiment::Single, &[("kitti/00", "kitti/00")]);
    // At 10 m both solve a and b. At 15 m fb reports no pose of a; mi is 20 m off on b, which is no
    // success and yet a query that both report as solved.
    let results = [
        ("a", 10.0, Some(0.1), Some(2.0)),
        ("b", 10.0, Some(0.3), Some(4.0)),
        ("a", 15.0, None, Some(1.0)),
        ("b", 15.0, Some(0.5), Some(20.0)),
    ];
    let rows: Vec<Row> = results
        .iter()
        .flat_map(|(query, radius, fb, mi)| {
            [("fb", fb), ("mi", mi)]
                .map(|(method, error)| at(row(query, method, *error), "kitti/00", *radius, 1, None))
        })
        .collect();
    let tables = tables(&run, &measure(&rows, 10.0));
    assert_eq!(
        lines(&tables, "single-translation-kitti-00"),
        [
            "#images | 2 (100.0 %) | 1 (50.0 %)",
            "#images (paper) | 406 (89 %) | 328 (72 %)",
            "FB | 0.20 | 0.50",
            "FB (paper) | 0.13 | 0.40",
            "MI | 3.00 | 20.00",
            "MI (paper) | 1.56 | 5.41",
        ]
    );
    // The greatest Euler angle of the canned errors is half of their metres.
    let rotation = lines(&tables, "single-rotation-kitti-00");
    assert_eq!(rotation[2], "FB | 0.10 | 0.25");
    assert_eq!(rotation[3], "FB (paper) | 1.76 | 3.83");
    let success = lines(&tables, "single-success-kitti-00");
    assert_eq!(success, ["FB | 100.0 | 50.0", "MI | 100.0 | 50.0"]);
    // Failures are infinite: half of the queries at 15 m is within no limit for fb.
    assert!(lines(&tables, "overview")[2].ends_with("| 0.0 | 50.0 | 50.0"));
}

#[test]
fn the_multi_table_has_the_rmse_over_the_successes_of_each_fusion() {
    let run = run(Experiment::Multi, &[("street", "street")]);
    let mut rows = Vec::new();
    for (query, one, avg, robust) in [
        ("a", Some(3.0), Some(1.0), Some(0.6)),
        ("b", None, Some(7.0), Some(0.8)),
    ] {
        for method in ["fb", "mi"] {
            for (count, fusion, error) in [
                (1, "avg", one),
                (1, "r-wavg", one),
                (2, "avg", avg),
                (2, "r-wavg", robust),
            ] {
                rows.push(at(
                    row(query, method, error),
                    "street",
                    10.0,
                    count,
                    Some(fusion),
                ));
            }
        }
    }
    let tables = tables(&run, &measure(&rows, 10.0));
    // √((1 + 49)/2) = 5, √((0.36 + 0.64)/2) = 0.707; angles are half of that.
    assert_eq!(
        lines(&tables, "multi-rmse-street")[..4],
        [
            "FB avg | 3.000 | 1.50 | 5.000 | 2.50",
            "FB avg (median) | 3.000 | 1.50 | 4.000 | 2.00",
            "FB r-wavg | 3.000 | 1.50 | 0.707 | 0.35",
            "FB r-wavg (median) | 3.000 | 1.50 | 0.700 | 0.35",
        ]
    );
    let success = lines(&tables, "multi-success-street");
    assert_eq!(success[0], "FB avg | 50.0 | 100.0");
}

#[test]
fn the_large_table_and_the_confusion_matrix_place_every_pair() {
    let scenes = [("kitti/01", "kitti/01"), ("kitti/01", "rain")];
    let run = run(Experiment::Large, &scenes);
    let with_rain = |row: Row| Row {
        query_scene: Some("rain".to_owned()),
        ..row
    };
    let fused = |row: Row| at(row, "kitti/01", 10.0, 2, Some("r-wavg"));
    let rows = [
        fused(row("a", "fb", Some(3.0))),
        fused(row("a", "mi", Some(4.0))),
        fused(with_rain(row("a", "fb", None))),
        fused(with_rain(row("a", "mi", Some(6.0)))),
    ];
    let tables = tables(&run, &measure(&rows, 10.0));
    assert_eq!(
        lines(&tables, "large"),
        [
            "kitti/01 | FB | 1 | 100.0 | 3.000 | 1.500 | 3.000 | 1.500 | 84.5 | 0.494 | 0.567",
            "kitti/01 | MI | 1 | 100.0 | 4.000 | 2.000 | 4.000 | 2.000 | 60.0 | 0.980 | 0.353",
            "kitti/01, queries from rain | FB | 1 | 0.0 | – | – | – | – | – | – | –",
            "kitti/01, queries from rain | MI | 1 | 100.0 | 6.000 | 3.000 | 6.000 | 3.000 | – | – | –",
        ]
    );
    assert_eq!(
        lines(&tables, "confusion"),
        [
            "kitti/01 | FB | 100.0 | 3.000 | 1.500 | 0.0 | – | –",
            "kitti/01 | MI | 100.0 | 4.000 | 2.000 | 100.0 | 6.000 | 3.000",
        ]
    );
}

#[test]
fn the_large_table_has_no_columns_for_figures_that_the_paper_does_not_have() {
    let run = run(Experiment::Large, &[("street", "street")]);
    let rows = [at(
        row("a", "fb", Some(3.0)),
        "street",
        10.0,
        2,
        Some("r-wavg"),
    )];
    let tables = tables(&run, &measure(&rows, 10.0));
    assert_eq!(
        lines(&tables, "large"),
        ["street | FB | 1 | 100.0 | 3.000 | 1.500 | 3.000 | 1.500"]
    );
    assert!(
        tables
            .iter()
            .all(|table| !table.markdown().contains("paper"))
    );
}

#[test]
fn a_run_file_is_read_as_it_was_written() {
    let run = run(Experiment::Multi, &[("street", "street")]);
    let text = toml::to_string(&run).expect("every field has a form");
    assert_eq!(toml::from_str::<RunFile>(&text).expect("just written"), run);
}
