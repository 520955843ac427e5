//! The number of operations each trigonometric formula takes, as its documentation states it.

use vsonar_ir::formula::trig;
use vsonar_ir::machine::Machine;

/// Counts operations; constants and changes of view cost nothing.
#[derive(Default)]
struct Counter {
    divisions: u32,
    total: u32,
}

macro_rules! counted {
    ($($name:ident($($operand:ident),+);)+) => {
        $(fn $name(&mut self, $($operand: ()),+) {
            $(let () = $operand;)+
            self.total += 1;
        })+
    };
}

impl Machine for Counter {
    type F = ();
    type I = ();
    type M = ();

    fn f32(&mut self, _: f32) {}
    fn i32(&mut self, _: i32) {}
    fn mask(&mut self, _: bool) {}
    fn to_bits(&mut self, (): ()) {}
    fn from_bits(&mut self, (): ()) {}

    fn div(&mut self, (): (), (): ()) {
        self.divisions += 1;
        self.total += 1;
    }
    fn ishl(&mut self, (): (), _: u32) {
        self.total += 1;
    }
    fn iushr(&mut self, (): (), _: u32) {
        self.total += 1;
    }
    counted! {
        add(a, b);
        sub(a, b);
        mul(a, b);
        lt(a, b);
        le(a, b);
        eq(a, b);
        select(mask, a, b);
        iselect(mask, a, b);
        and(a, b);
        or(a, b);
        not(a);
        iadd(a, b);
        isub(a, b);
        iand(a, b);
        ior(a, b);
        ixor(a, b);
        ieq(a, b);
        ilt(a, b);
    }
}

#[test]
fn formulas_are_as_short_as_stated() {
    type Case = (&'static str, fn(&mut Counter), u32, u32);
    let cases: [Case; 5] = [
        ("sin", |m| trig::sin(m, ()), 19, 0),
        ("cos", |m| trig::cos(m, ()), 20, 0),
        ("tan", |m| trig::tan(m, ()), 24, 1),
        ("atan", |m| trig::atan(m, ()), 20, 1),
        ("atan2", |m| trig::atan2(m, (), ()), 29, 1),
    ];
    for (name, formula, total, divisions) in cases {
        let mut counter = Counter::default();
        formula(&mut counter);
        assert_eq!((counter.total, counter.divisions), (total, divisions), "{name}: operations, divisions");
    }
}
