//! From how many fitness cases on it pays to compile.

use serde::Serialize;

use super::measure::{Measured, Runs};
use super::spread::{Spread, median};

/// What running an individual costs, in seconds: once, and for each fitness case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Before the first case: compiling, and where only one of two executors lowers, lowering.
    pub fixed: f64,
    /// For each case.
    pub case: f64,
}

impl Cost {
    /// The number of cases from which `self`, a compiler's, is no more than that of an interpreter: 0 where it
    /// never is more, infinity where no case costs less.
    ///
    /// ```
    /// use vsonar::benchmark::Cost;
    /// let (compiled, interpreted) = (Cost { fixed: 80.0, case: 1.0 }, Cost { fixed: 0.0, case: 5.0 });
    /// assert_eq!(compiled.pays_from(interpreted), 20.0);
    /// assert_eq!(Cost { fixed: 80.0, case: 5.0 }.pays_from(interpreted), f64::INFINITY);
    /// ```
    pub fn pays_from(self, interpreter: Cost) -> f64 {
        let (more, saved) = (self.fixed - interpreter.fixed, interpreter.case - self.case);
        if saved > 0.0 { (more / saved).max(0.0) } else { f64::INFINITY }
    }
}

/// The break-even of a compiling executor against the fastest interpreting one, over the individuals that both ran.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BreakEven {
    /// The executor that compiles.
    pub executor: String,
    /// The one that does not: the fastest of those that were measured.
    pub interpreter: String,
    /// Individuals that both ran.
    pub individuals: usize,
    /// Number of fitness cases from which compiling pays; `null` where it never does.
    pub cases: Spread,
    /// Share of the individuals for which interpreting is faster with any number of cases.
    pub always_interpret: f64,
    /// Share of those for which compiling is faster even with a single case.
    pub always_compile: f64,
    /// Share of those for which compiling is faster with the cases that were measured.
    pub compile_here: f64,
}

/// The executor that picks one or the other, which is neither.
const PICKS: &str = "auto";

/// Whether an executor compiles every individual (`Some(true)`), none (`Some(false)`), or now this, now that.
fn compiles(runs: &Runs) -> Option<bool> {
    let mut compiled = runs.times.iter().flatten().map(|times| times.compile > 0.0);
    let first = compiled.next().filter(|_| runs.name != PICKS)?;
    compiled.all(|c| c == first).then_some(first)
}

impl BreakEven {
    /// That of each executor that compiles; none if no other one was measured.
    pub(super) fn all(measured: &Measured) -> Vec<BreakEven> {
        // Sub-samples are of the same individuals, so their medians rank executors well enough.
        let typical = |runs: &Runs| median(runs.times.iter().flatten().map(|times| times.together));
        let interpreters = measured.runs.iter().filter(|runs| compiles(runs) == Some(false));
        let Some(interpreter) = interpreters.min_by(|a, b| typical(a).total_cmp(&typical(b))) else {
            return Vec::new();
        };
        let compilers = measured.runs.iter().filter(|runs| compiles(runs) == Some(true));
        compilers.filter_map(|runs| BreakEven::of(runs, interpreter, measured.cases)).collect()
    }

    fn of(compiler: &Runs, interpreter: &Runs, cases: usize) -> Option<BreakEven> {
        let both =
            compiler.times.iter().zip(&interpreter.times).filter_map(|(a, b)| a.as_ref().zip(b.as_ref()));
        let points: Vec<f64> = both
            .map(|(a, b)| {
                // What both do is no difference, and its two measurements are noise.
                let lower = if interpreter.lowers { 0.0 } else { a.lower };
                let case = |execute: f64| execute / cases.max(1) as f64;
                let compiled = Cost { fixed: lower + a.compile, case: case(a.execute) };
                compiled.pays_from(Cost { fixed: b.compile, case: case(b.execute) })
            })
            .collect();
        let share = |test: &dyn Fn(f64) -> bool| {
            points.iter().filter(|&&p| test(p)).count() as f64 / points.len() as f64
        };
        (!points.is_empty()).then(|| BreakEven {
            executor: compiler.name.to_string(),
            interpreter: interpreter.name.to_string(),
            individuals: points.len(),
            cases: Spread::of(points.iter().copied()),
            always_interpret: share(&|p| p.is_infinite()),
            always_compile: share(&|p| p <= 1.0),
            compile_here: share(&|p| p <= cases as f64),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::measure::Times;
    use super::*;

    fn runs(name: &'static str, lowers: bool, times: &[Option<[f64; 3]>]) -> Runs {
        let times = times.iter().map(|t| {
            t.map(|[lower, compile, execute]| Times {
                lower,
                compile,
                execute,
                together: lower + compile + execute,
            })
        });
        Runs { name, lowers, rounds: 1, times: times.collect(), totals: vec![] }
    }

    #[test]
    fn costs_meet_where_they_are_equal() {
        let interpreter = Cost { fixed: 0.0, case: 3.0 };
        let from = |fixed, case| Cost { fixed, case }.pays_from(interpreter);
        assert_eq!(
            [from(10.0, 1.0), from(0.0, 1.0), from(10.0, 3.0), from(10.0, 4.0)],
            [5.0, 0.0, f64::INFINITY, f64::INFINITY]
        );
    }

    #[test]
    fn the_fastest_interpreter_is_the_measure() {
        let jit =
            runs("jit", true, &[Some([1.0, 8.0, 10.0]), Some([1.0, 8.0, 90.0]), Some([1.0, 0.5, 10.0])]);
        let slow = runs("slow", false, &[Some([0.0, 0.0, 900.0]), None, None]);
        let fast =
            runs("fast", true, &[Some([1.0, 0.0, 50.0]), Some([2.0, 0.0, 50.0]), Some([1.0, 0.0, 50.0])]);
        let auto = runs("auto", true, &[Some([0.0, 0.0, 1.0]); 3]);
        let measured = |runs| Measured { cases: 10, subjects: vec![], runs };
        let found = BreakEven::all(&measured(vec![jit.clone(), slow.clone(), fast, auto]));
        assert_eq!(found.len(), 1);
        let found = &found[0];
        assert_eq!(
            (found.executor.as_str(), found.interpreter.as_str(), found.individuals),
            ("jit", "fast", 3)
        );
        // 8 / (5 - 1), never, and 0.5 / 4
        assert_eq!((found.cases.q1, found.cases.median), (1.0625, 2.0));
        let shares = [found.always_interpret, found.always_compile, found.compile_here];
        assert_eq!(shares, [1.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0]);
        // One that does not even lower: lowering is the compiler's cost, and only its individuals count.
        let found = BreakEven::all(&measured(vec![jit, slow]));
        assert_eq!((found[0].individuals, found[0].cases.median), (1, 9.0 / 89.0));
        let none = BreakEven::all(&measured(vec![runs("jit", true, &[Some([0.0, 1.0, 1.0])])]));
        assert_eq!(none, []);
    }
}
