//! A small plot of the best and the mean fitness of a run's generations, in characters.

use vsonar::evolve::Record;

use super::output::percent;

/// Lines of the plot.
const HEIGHT: usize = 8;
/// The most columns that it is useful with.
const WIDEST: usize = 72;
/// Cells of the axis.
const AXIS: usize = 8;

/// The plot in lines of at most `width` cells; nothing for fewer than two generations.
pub(crate) fn plot(records: &[Record], width: usize, unicode: bool) -> String {
    let last = records.len().saturating_sub(1);
    if last == 0 {
        return String::new();
    }
    let columns = width.saturating_sub(AXIS).clamp(1, WIDEST);
    // The generation at a column; of few generations each has several.
    let at = |column: usize| &records[(column * last + (columns - 1) / 2) / (columns - 1).max(1)];
    let top = records.iter().map(|record| record.best_fitness).fold(0.0, f64::max);
    let top = (top * 10.0).ceil().clamp(1.0, 10.0) / 10.0;
    // How many lines a share fills; what is there is seen.
    let filled =
        |share: f64| if share > 0.0 { (share / top * HEIGHT as f64).round().max(1.0) as usize } else { 0 };
    let (best, mean, bar) = if unicode { ('░', '█', '│') } else { (':', '#', '|') };
    let mut out = String::new();
    for line in (1..=HEIGHT).rev() {
        let label = match line {
            HEIGHT => percent(top),
            1 => percent(0.0),
            _ => String::new(),
        };
        let cell = |column| match at(column) {
            record if filled(record.mean_fitness) >= line => mean,
            record if filled(record.best_fitness) >= line => best,
            _ => ' ',
        };
        let cells: String = (0..columns).map(cell).collect();
        out += format!("{label:>7}{bar}{cells}").trim_end();
        out += "\n";
    }
    out + &format!("{:AXIS$}generations 0 to {last}: {best} best, {mean} mean\n", "")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn records(shares: &[(f64, f64)]) -> Vec<Record> {
        let record = |&(best, mean): &(f64, f64)| -> Record {
            serde_json::from_value(serde_json::json!({
                "generation": 0, "best_fitness": best, "mean_fitness": mean, "median_fitness": mean,
                "best_fitness_so_far": best, "evaluations": 1, "evaluations_total": 1, "best_nodes": 9,
                "mean_nodes": 9.0, "max_nodes": 9, "mean_depth": 3.0, "max_depth": 3, "distinct_programs": 1,
                "distinct_behaviours": 1, "constant_share": 0.0,
                "timing": vsonar::evolve::GenerationTiming::default(),
            }))
            .expect("a record")
        };
        shares.iter().map(record).collect()
    }

    #[test]
    fn curves_rise_as_they_should() {
        let records = records(&[(0.2, 0.0), (0.4, 0.1), (0.8, 0.4)]);
        let text = plot(&records, AXIS + 3, false);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], " 80.0 %|  :");
        assert_eq!(lines[4], "       | :#");
        assert_eq!(lines[7], "  0.0 %|:##");
        assert_eq!(lines.len(), HEIGHT + 1);
        assert!(lines[8].ends_with("generations 0 to 2: : best, # mean"), "{}", lines[8]);
    }

    #[test]
    fn every_run_and_width_has_a_plot() {
        for shares in [vec![(0.0, 0.0); 2], vec![(1.0, 1.0); 5], vec![(0.3, 0.1); 500]] {
            for width in [0, 1, 20, 80, 300] {
                let text = plot(&records(&shares), width, true);
                let plot = text.lines().take(HEIGHT);
                assert!(
                    plot.clone().all(|line| line.chars().count() <= width.max(AXIS + 1)),
                    "{width}:\n{text}"
                );
            }
        }
        assert_eq!(plot(&records(&[(0.5, 0.2)]), 80, true), "", "one generation is no curve");
        assert!(plot(&records(&[(0.5, 0.2); 2]), 80, false).is_ascii());
    }
}
