use posescope_core::scale::Scale;

use super::*;

#[test]
fn references_reach_as_far_as_the_prior_and_without_one_as_the_radius() {
    let mut protocol = Protocol::default();
    assert_eq!(protocol.reach_m(Protocol::RADIUS_M), 15.0);
    protocol.prior_m = Some(200.0);
    assert_eq!(protocol.reach_m(Protocol::RADIUS_M), 200.0);
}

#[test]
fn options_are_what_differs_from_the_defaults() {
    let protocol = Protocol {
        methods: vec![Method::FB, Method::MI],
        radii_m: vec![12.5],
        references: ["62", "64"].map(|name| Reference::Frame(name.to_owned())).into(),
        min_confidence: Some(0.5),
        ..Protocol::default()
    };
    let options = protocol.options();
    let options: Vec<String> =
        options.iter().map(|(key, value)| format!("{key} {value}")).collect();
    assert_eq!(
        options,
        ["method fb,mi", "min-confidence 0.5", "radius 12.5", "reference 62", "reference 64"]
    );
    assert_eq!(Protocol::default().options(), []);
}

#[test]
fn frames_and_a_choice_do_not_go_together() {
    let frame = Reference::Frame("62".to_owned());
    let mixed = Protocol {
        references: vec![frame, Reference::Chosen(Selection::Nearest(2))],
        ..Protocol::default()
    };
    assert_eq!(mixed.checked(), Err(ProtocolError::References));
}

#[test]
fn presets_ask_what_the_experiments_of_the_paper_do() {
    let of = |name: &str, scene: &str| {
        let preset: Preset = name.parse().expect("a preset");
        assert_eq!(preset.name(), name);
        defaults(Some(preset), scene)
    };
    let single = of("single", "kitti/00");
    assert_eq!(single.radii_m, [10.0, 15.0, 20.0, 25.0]);
    assert_eq!(single.methods, [Method::FB, Method::PM, Method::MI]);
    assert_eq!(single.limit, Some(Limit::Percent(10.0)));
    let multi = of("multi", "kitti/00");
    let five = Reference::Chosen(Selection::Random(5));
    assert_eq!(multi.references, [five]);
    assert_eq!(multi.fusions, Fusion::all().filter(|one| one.name != "joint").collect::<Vec<_>>());
    let large = |scene| {
        let large = of("large", scene);
        (large.prior_m, large.failure_radius_m)
    };
    assert_eq!(large("kitti/00"), (Some(200.0), Some(10.0)));
    assert_eq!(large("robotcar/a"), (Some(50.0), Some(20.0)));
    assert!("small".parse::<Preset>().is_err());
}

#[test]
fn all_lengths_of_a_protocol_follow_the_size_of_the_scene() {
    let room = SceneSize { scale: Scale::of_depth(1.8, true), ..SceneSize::PAPER };
    let own = defaults(None, "room").at_size(&room);
    assert_eq!((own.radii_m, own.failure_radius_m), (vec![1.0], Some(1.0)));
    assert_eq!(own.right.to_string(), "0.1m,5deg");
    let large = defaults("large".parse().ok(), "room").at_size(&room);
    assert_eq!((large.radii_m, large.prior_m), (vec![1.5], Some(20.0)));
    let street = defaults(None, "street");
    assert_eq!(street.clone().at_size(&SceneSize::PAPER), street);
}
