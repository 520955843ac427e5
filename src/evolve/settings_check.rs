//! Which values of the settings are possible.

use super::settings::{Fault, Settings};
use crate::tree::{MAX_WEIGHT, Node, NodeSet, NodeType};

/// The largest seed: the largest integer that TOML knows.
const MAX_SEED: u64 = i64::MAX as u64;
/// The largest population; a generation is held in memory at once.
const MAX_POPULATION: u32 = 10_000_000;

fn must<T: std::fmt::Display>(holds: bool, field: &str, value: T, must: &str) -> Result<(), Fault> {
    if holds {
        return Ok(());
    }
    Err(Fault { field: field.to_string(), value: value.to_string(), must: must.to_string(), beside: None })
}

/// Names the field that a fault is a matter of as well.
trait Beside {
    fn beside(self, field: &'static str) -> Self;
}

impl Beside for Result<(), Fault> {
    fn beside(self, field: &'static str) -> Self {
        self.map_err(|fault| Fault { beside: Some(field), ..fault })
    }
}

impl Settings {
    /// The first impossible value, if there is one.
    pub(super) fn check(&self) -> Result<(), Fault> {
        must(self.seed <= MAX_SEED, "seed", self.seed, "at most 9223372036854775807")?;
        must(
            (2..=MAX_POPULATION).contains(&self.population),
            "population",
            self.population,
            "2 to 10,000,000 individuals",
        )?;
        must(
            (1..=1_000_000).contains(&self.generations),
            "generations",
            self.generations,
            "1 to 1,000,000, the initial one included",
        )?;
        must((1..=2).contains(&self.trees), "trees", self.trees, "1 or 2")?;
        must(
            self.tolerance.is_finite() && self.tolerance >= 0.0,
            "tolerance",
            self.tolerance,
            "a number of rows, 0 or more",
        )?;
        self.check_creation()?;
        self.check_rest()
    }

    fn check_creation(&self) -> Result<(), Fault> {
        let c = &self.creation;
        let limit = self.breeding.max_depth;
        must((2..=100).contains(&limit), "breeding.max_depth", limit, "2 to 100")?;
        must(
            (2..=limit).contains(&c.max_depth),
            "creation.max_depth",
            c.max_depth,
            "2 to `breeding.max_depth`",
        )
        .beside("breeding.max_depth")?;
        must(
            (2..=c.max_depth).contains(&c.min_depth),
            "creation.min_depth",
            c.min_depth,
            "2 to `creation.max_depth`",
        )
        .beside("creation.max_depth")?;
        must(
            c.column_depth < limit,
            "creation.column_depth",
            c.column_depth,
            "less than `breeding.max_depth`",
        )
        .beside("breeding.max_depth")?;
        probability("creation.full_probability", c.full_probability)?;
        probability("creation.grow_leaf_probability", c.grow_leaf_probability)?;
        probability("creation.plain_column_probability", c.plain_column_probability)?;
        must(
            c.plain_column_probability == 0.0 || self.nodes.weight(Node::XObstacle.node_type()) > 0,
            "creation.plain_column_probability",
            c.plain_column_probability,
            "0 while the node type `x-obstacle`, which plain columns are made of, is left out: \
             `--set creation.plain_column_probability=0`",
        )
        .beside("nodes.x-obstacle")?;
        must(
            c.constant_min >= 1e-30 && c.constant_min <= 1e30,
            "creation.constant_min",
            c.constant_min,
            "1e-30 to 1e30",
        )?;
        must(
            c.constant_max >= c.constant_min && c.constant_max <= 1e30,
            "creation.constant_max",
            c.constant_max,
            "`creation.constant_min` to 1e30",
        )
        .beside("creation.constant_min")
    }

    fn check_rest(&self) -> Result<(), Fault> {
        let (b, s, f) = (&self.breeding, &self.selection, &self.filter);
        self.check_mutation()?;
        self.check_islands()?;
        probability("breeding.internal_probability", b.internal_probability)?;
        must(b.redraws <= 1000, "breeding.redraws", b.redraws, "0 to 1,000")?;
        must(
            (1..=1_000_000).contains(&s.tournament),
            "selection.tournament",
            s.tournament,
            "1 to 1,000,000",
        )?;
        must(
            s.case_share > 0.0 && s.case_share <= 1.0,
            "selection.case_share",
            s.case_share,
            "more than 0 and at most 1",
        )?;
        must(
            (1.0..=2.0).contains(&s.size_tournament),
            "selection.size_tournament",
            s.size_tournament,
            "1 to 2",
        )?;
        probability("filter.in_range", f.in_range)?;
        must(
            (1..=1_000_000_000).contains(&f.max_draws),
            "filter.max_draws",
            f.max_draws,
            "1 to 1,000,000,000",
        )?;
        self.check_augmentation()?;
        self.nodes.check().map_err(|error| Fault {
            field: "nodes".to_string(),
            value: format!("\"{}\"", self.nodes),
            must: format!("enough to make trees of: {error}"),
            beside: None,
        })
    }
}

/// The sum of probabilities may be beyond 1 by what their roundings come to.
const ROUNDING: f64 = 1e-9;

impl Settings {
    fn check_mutation(&self) -> Result<(), Fault> {
        let b = &self.breeding;
        probability("breeding.crossover_probability", b.crossover_probability)?;
        let mut sum = b.crossover_probability;
        for (field, value) in [
            ("breeding.subtree_mutation_probability", b.subtree_mutation_probability),
            ("breeding.point_mutation_probability", b.point_mutation_probability),
            ("breeding.constant_mutation_probability", b.constant_mutation_probability),
            ("breeding.hoist_mutation_probability", b.hoist_mutation_probability),
        ] {
            probability(field, value)?;
            let room = (1.0 - sum).max(0.0);
            sum += value;
            let most = format!(
                "at most {room:.6}, what `breeding.crossover_probability` and the mutations named before it in \
                 settings.toml leave of 1"
            );
            must(value == 0.0 || sum <= 1.0 + ROUNDING, field, value, &most)
                .beside("breeding.crossover_probability")?;
        }
        let depth = b.mutation_depth;
        must((1..=100).contains(&depth), "breeding.mutation_depth", depth, "1 to 100")?;
        must(
            b.constant_step > 0.0 && b.constant_step <= 10.0,
            "breeding.constant_step",
            b.constant_step,
            "more than 0 and at most 10",
        )
    }

    fn check_islands(&self) -> Result<(), Fault> {
        let i = &self.islands;
        let half = format!("1 to half the population, {}", self.population / 2);
        must((1..=self.population / 2).contains(&i.count), "islands.count", i.count, &half)
            .beside("population")?;
        must((1..=1_000_000).contains(&i.interval), "islands.interval", i.interval, "1 to 1,000,000")?;
        let island = self.population / i.count;
        if i.count > 1 {
            let fewer = format!("less than an island has individuals, {island}");
            must(i.migrants < island, "islands.migrants", i.migrants, &fewer).beside("islands.count")?;
        }
        let elitism = self.selection.elitism;
        let fewer = match i.count {
            1 => format!("less than the population, {island}"),
            _ => format!("less than an island has individuals, {island}"),
        };
        must(elitism < island, "selection.elitism", elitism, &fewer).beside("population")
    }
}

impl Settings {
    fn check_augmentation(&self) -> Result<(), Fault> {
        let a = &self.augmentation;
        must(
            (1..=100).contains(&a.variants),
            "augmentation.variants",
            a.variants,
            "1 to 100 copies of an image",
        )?;
        probability("augmentation.mirror", a.mirror)?;
        for (field, value, most) in [
            ("augmentation.gain", a.gain, 10.0),
            ("augmentation.brightness", a.brightness, 255.0),
            ("augmentation.contrast", a.contrast, 10.0),
            ("augmentation.gamma", a.gamma, 10.0),
            ("augmentation.noise", a.noise, 255.0),
            ("augmentation.blur", a.blur, 20.0),
        ] {
            must((0.0..=most).contains(&value), field, value, &format!("a number from 0 to {most}"))?;
        }
        for (field, value) in [("augmentation.shift_x", a.shift_x), ("augmentation.shift_y", a.shift_y)] {
            must(value <= 10_000, field, value, "0 to 10,000 pixels")?;
        }
        Ok(())
    }
}

fn probability(field: &str, value: f64) -> Result<(), Fault> {
    must((0.0..=1.0).contains(&value), field, value, "a number from 0 to 1")
}

/// Sets the weight of the node type of this name.
pub(super) fn set_weight(nodes: &mut NodeSet, name: &str, weight: u32) -> Result<(), Fault> {
    let field = format!("nodes.{name}");
    if NodeType::from_name(name).is_none() {
        let names: Vec<&str> = NodeType::all().map(NodeType::name).collect();
        let advice = format!("left out: there is no such node type, only {}", names.join(" "));
        return must(false, &field, weight, &advice);
    }
    let set = nodes.edit(&format!("{name}={weight}"));
    must(set.is_ok(), &field, weight, &format!("a whole number from 0 to {MAX_WEIGHT}"))
}
