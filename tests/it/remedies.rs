//! What would have helped, tried by `--explain`.

use crate::binary::run_in;

/// A fusion that one reference dragged is no matter of settings: other fusions are tried before other methods.
#[test]
fn against_a_dragged_fusion_other_fusions_are_tried_first() {
    let folder = tempfile::tempdir().expect("a folder");
    let asked = "run street --query-scene street:rain --query 224 --reference 219 --reference 218 \
                 --reference 237 --method fb --fusion avg --explain --json - --quiet";
    let said = run_in(folder.path(), asked);
    let line = said.out.lines().next().expect("a result");
    let result: serde_json::Value = serde_json::from_str(line).expect("an object");
    assert_eq!(result["diagnosis"][0]["code"], "F1", "{line}");
    let helped = result["explanation"]["helped"].as_array().expect("something helped");
    assert_eq!(helped[0]["args"], serde_json::json!(["--fusion", "joint"]), "{helped:?}");
}
