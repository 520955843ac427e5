//! Program files that are none: one clear error with file and position.

use crate::common::*;

/// In a body that is sound otherwise.
fn body(body: &str) -> String {
    format!("(individual\n  (iterate-up 3x3 x-obstacle\n    {body}))\n")
}

fn column(column: &str) -> String {
    format!("(individual\n  (iterate-up 3x3\n    {column}\n (set-a y)))\n")
}

#[test]
fn faults_have_a_position_and_a_remedy() {
    let place = Place::new();
    let cases: &[(&str, String, &str, &[&str])] = &[
        ("an unknown node", body("(set-a gradeint)"), "line 3, column 12", &["unknown node", "`gradient`"]),
        ("a wrong arity", body("(set-a (+ y))"), "line 3, column", &["`+` takes 2 arguments", "1"]),
        ("one argument too many", body("(set-a y x)"), "line 3, column", &["`set-a` takes 1 argument"]),
        ("iterate below the root", body("(iterate-up 3x3 x-obstacle y)"), "line 3, column", &["root"]),
        (
            "a window in a column expression",
            column("(+ x-obstacle gradient)"),
            "line 3, column 19",
            &["x-obstacle"],
        ),
        ("a register in a column expression", column("read-a"), "line 3, column 5", &["column expression"]),
        (
            "a rectangle that is not there",
            body("y").replace("3x3", "9x9"),
            "line 2, column 15",
            &["9x9", "8x8"],
        ),
        ("a constant that is no number", body("(set-a 1.2.3)"), "line 3, column 12", &["1.2.3", "number"]),
        ("an infinity", body("(set-a inf)"), "line 3, column 12", &["finite"]),
        ("a constant that overflows", body("(set-a 1e39)"), "line 3, column 12", &["too large"]),
        ("nothing", String::new(), "line 1", &["(individual"]),
        ("an open parenthesis", "(individual (iterate-up 3x3".to_string(), "line 1", &["missing"]),
        ("something after it", body("y") + "y", "line 4", &["nothing may follow"]),
        ("a first tree that reads itself", body("iter2-a"), "line 3", &["first tree"]),
    ];
    for (what, text, position, said) in cases {
        place.write("bad.gp", text);
        let complaint = place.fails(1, &["eval", "bad.gp", "--data", "data"]);
        assert!(complaint.contains("bad.gp") && complaint.contains(position), "{what}: {complaint}");
        for part in *said {
            assert!(complaint.contains(part), "{what}: no {part:?} in {complaint}");
        }
        assert_eq!(place.fails(1, &["ir", "bad.gp"]), complaint, "{what}");
    }
}

#[test]
fn monsters_are_refused() {
    let place = Place::new();
    let deep = format!("{}y{}", "(sin ".repeat(100_000), ")".repeat(100_000));
    place.write("deep.gp", body(&format!("(set-a {deep})")));
    let complaint = place.fails(1, &["ir", "deep.gp"]);
    assert!(complaint.contains("nested too deeply") && complaint.contains("1000"), "{complaint}");
    place.write("open.gp", "(".repeat(1_000_000));
    place.fails(1, &["ir", "open.gp"]);
    // A million nodes, and no deeper than 20.
    let mut wide = "y".to_string();
    for _ in 0..19 {
        wide = format!("(+ {wide} {wide})");
    }
    place.write("wide.gp", body(&wide));
    let complaint = place.fails(1, &["eval", "wide.gp", "--data", "data"]);
    assert!(complaint.contains("too large"), "{complaint}");
    // As deep as is allowed is no monster, on every executor.
    let deep = format!("{}y{}", "(sin ".repeat(990), ")".repeat(990));
    place.write("deep.gp", body(&format!("(set-a {deep})")));
    let answers: Vec<String> = ["tree", "reference", "cranelift-scalar", "cranelift", "batch", "auto"]
        .map(|e| place.ok(&["eval", "deep.gp", "--data", "data", "--answers", "-", "--executor", e]))
        .into();
    assert!(answers.iter().all(|a| *a == answers[0]));
}

#[test]
fn files_that_are_no_text() {
    let place = Place::new();
    place.write("bytes.gp", [0xff, 0xfe, 0x00]);
    assert!(place.fails(1, &["ir", "bytes.gp"]).contains("bytes.gp"));
    place.write("bytes.vir", [0xff, 0xfe, 0x00]);
    assert!(place.fails(1, &["ir", "bytes.vir"]).contains("bytes.vir"));
    assert!(place.fails(1, &["ir", "missing.gp"]).contains("missing.gp"));
    assert!(place.fails(1, &["ir", "missing.vir"]).contains("missing.vir"));
    assert!(place.fails(1, &["ir", "data"]).contains("data"));
    place.write("bad.vir", "vir 1\nimage 64x48\nloop 3\n");
    let complaint = place.fails(1, &["ir", "bad.vir"]);
    assert!(complaint.contains("bad.vir") && complaint.contains("line 3"), "{complaint}");
    place.write("later.vir", "vir 999\n");
    assert!(place.fails(1, &["ir", "later.vir"]).contains("line 1"));
}
