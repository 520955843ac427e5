//! The formulas above plain arithmetic as C functions: trigonometry and its kin, the bits of a number, the place on the
//! floor, the median of three frames.

use std::collections::BTreeSet;

use vsonar_ir::Op;
use vsonar_ir::op::Value;

use super::live::Live;
use super::writer::Writer;
use crate::camera::Camera;
use crate::camera::ground::{Ground, median_of_three};

/// The operations of a loop that are functions.
pub(super) fn called(live: &Live<'_>, ops: &mut BTreeSet<Op>) {
    let blocks = [(live.l.column().block(), &live.column), (live.l.body(), &live.body)];
    for (block, needed) in blocks {
        let insts = block.insts().iter().zip(needed).filter(|(_, needed)| **needed);
        ops.extend(insts.map(|(inst, _)| inst.op()).filter(|op| op.function().is_some()));
    }
}

/// An operation as a function.
pub(super) fn operation(prefix: &str, op: Op) -> String {
    const NAMES: [&str; 3] = ["a", "b", "c"];
    let mut w = Writer::new(prefix);
    let args: Vec<Value<Writer<'_>>> =
        NAMES[..op.operands().len()].iter().map(|name| Value::F32(w.text(*name))).collect();
    let (Some(about), Some(value)) = (op.function(), op.apply(&mut w, &args, 0)) else {
        unreachable!("only functions are called")
    };
    let (body, names) = w.print(&[value.f32()], "    ");
    let params: Vec<String> = NAMES[..args.len()].iter().map(|name| format!("float {name}")).collect();
    format!(
        "/* {about} */\nstatic float {prefix}_{}({})\n{{\n{body}    return {};\n}}\n\n",
        op.name(),
        params.join(", "),
        names[0]
    )
}

/// The changes between a number and its bits that `text` asks for.
pub(super) fn bits(prefix: &str, text: &str) -> String {
    let mut out = String::new();
    for (name, from, to, about) in [
        ("float", ("uint32_t", "bits"), ("float", "value"), "The binary32 with these bits."),
        ("bits", ("float", "value"), ("uint32_t", "bits"), "The bits of a binary32."),
    ] {
        if text.contains(&format!("{prefix}_{name}(")) {
            out.push_str(&format!(
                "/* {about} */\nstatic {} {prefix}_{name}({} from)\n{{\n    union {{\n        float value;\n        \
                 uint32_t bits;\n    }} both;\n    both.{} = from;\n    return both.{};\n}}\n\n",
                to.0, from.0, from.1, to.1
            ));
        }
    }
    out
}

/// The place on the floor that a column and a row stand for.
pub(super) fn place(prefix: &str, camera: &Camera, size: (u32, u32)) -> String {
    let mut w = Writer::new(prefix);
    let (column, row) = (w.text("column"), w.text("row"));
    let range = Ground::new(camera, size.0, size.1).range(&mut w, column, row);
    let results = [range.bearing, range.distance, range.nearest, range.farthest, range.status];
    let takes_column = w.needs(&results, column);
    let (mut body, names) = w.print(&results, "    ");
    for (field, name) in ["bearing", "distance", "nearest", "farthest"].iter().zip(&names) {
        body.push_str(&format!("    range->{field} = {name};\n"));
    }
    let unused = if takes_column { "" } else { "    (void)column;\n" };
    format!(
        "/* The place on the floor of an obstacle whose lowest pixel is in this column and row. */\n\
         static void {prefix}_place(float column, float row, {prefix}_range *range)\n{{\n{body}    range->row = row;\n    \
         range->status = (int32_t){};\n{unused}}}\n\n",
        names[4]
    )
}

/// The row to believe after three frames.
pub(super) fn median(prefix: &str) -> String {
    const NAMES: [&str; 3] = ["current", "previous", "before"];
    let mut w = Writer::new(prefix);
    let [a, b, c] = NAMES.map(|name| w.text(name));
    let result = median_of_three(&mut w, a, b, c);
    let unused: String = [b, c]
        .iter()
        .zip(&NAMES[1..])
        .filter(|(id, _)| !w.needs(&[result], **id))
        .map(|(_, n)| format!("    (void){n};\n"))
        .collect();
    let (body, names) = w.print(&[result], "    ");
    format!(
        "/* The row to believe after three frames: the median of those that are finite. */\n\
         static float {prefix}_median_of_three(float current, float previous, float before)\n{{\n{body}{unused}    \
         return {};\n}}\n\n",
        names[0]
    )
}
