//! The cost model of one executor: a linear function of a program's features, fitted to the times measured so far.

use super::features::{COUNT, Features};

/// Measurements after which one counts half as much, so that the weights follow the populations.
const HALF_LIFE: f64 = 1000.0;
/// How much the weights before any measurement are trusted, in measurements.
const TRUST: f64 = 0.02;
/// Measurements between two fits.
const REFIT: u32 = 16;
/// Times below this many microseconds are not told apart.
const FLOOR: f64 = 2.0;

/// Weighted least squares with exponential forgetting, drawn towards the weights it started from.
///
/// Errors count relative to the time measured: a choice between two executors is about ratios, and programs differ
/// by a factor of a thousand.
#[derive(Debug, Clone)]
pub(super) struct Model {
    start: Features,
    weights: Features,
    /// Σ f fᵀ / t², and Σ f / t.
    moments: [[f64; COUNT]; COUNT],
    products: Features,
    since_fit: u32,
}

impl Model {
    /// A model with these weights, in microseconds for a unit of each feature.
    pub(super) fn new(start: Features) -> Model {
        let zeros = [0.0; COUNT];
        Model { start, weights: start, moments: [zeros; COUNT], products: zeros, since_fit: 0 }
    }

    /// The time expected, in microseconds.
    pub(super) fn predict(&self, features: &Features) -> f64 {
        let sum: f64 = self.weights.iter().zip(features).map(|(w, f)| w * f).sum();
        sum.max(FLOOR)
    }

    /// Learns from a time in microseconds.
    pub(super) fn learn(&mut self, features: &Features, time: f64) {
        let time = time.max(FLOOR);
        let keep = 0.5f64.powf(1.0 / HALF_LIFE);
        for (i, row) in self.moments.iter_mut().enumerate() {
            for (j, moment) in row.iter_mut().enumerate() {
                *moment = *moment * keep + features[i] * features[j] / (time * time);
            }
            self.products[i] = self.products[i] * keep + features[i] / time;
        }
        self.since_fit += 1;
        if self.since_fit >= REFIT {
            self.since_fit = 0;
            self.fit();
        }
    }

    /// Solves the normal equations by Cholesky's decomposition. The ridge, in units of the first weights, keeps the
    /// matrix positive definite whatever was measured.
    fn fit(&mut self) {
        let mut a = self.moments;
        let mut b = self.products;
        for i in 0..COUNT {
            let ridge = TRUST / (self.start[i] * self.start[i]).max(1e-12) / COUNT as f64;
            a[i][i] += ridge;
            b[i] += ridge * self.start[i];
        }
        for i in 0..COUNT {
            for j in 0..=i {
                let sum: f64 = (0..j).map(|k| a[i][k] * a[j][k]).sum();
                let rest = a[i][j] - sum;
                a[i][j] = if i == j { rest.max(1e-300).sqrt() } else { rest / a[j][j] };
            }
        }
        for i in 0..COUNT {
            let sum: f64 = (0..i).map(|k| a[i][k] * b[k]).sum();
            b[i] = (b[i] - sum) / a[i][i];
        }
        for i in (0..COUNT).rev() {
            let sum: f64 = (i + 1..COUNT).map(|k| a[k][i] * b[k]).sum();
            b[i] = (b[i] - sum) / a[i][i];
        }
        if b.iter().all(|w| w.is_finite()) {
            self.weights = b;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: Features = [10.0; COUNT];

    /// Some features, no two alike.
    fn example(n: u32) -> Features {
        std::array::from_fn(|i| f64::from((n * 7 + 3) * (i as u32 + 2) % 23) / 4.0)
    }

    fn time(features: &Features) -> f64 {
        5.0 + features.iter().enumerate().map(|(i, f)| (i + 1) as f64 * f).sum::<f64>()
            - 5.0 * features[0].min(1.0)
    }

    #[test]
    fn a_linear_cost_is_found() {
        let mut model = Model::new(START);
        let cost = |f: &Features| f.iter().enumerate().map(|(i, f)| (i + 1) as f64 * f).sum::<f64>();
        for n in 0..4000 {
            let features = example(n);
            model.learn(&features, cost(&features));
        }
        for n in 5000..5050 {
            let features = example(n);
            let ratio = model.predict(&features) / cost(&features).max(FLOOR);
            assert!((0.97..1.03).contains(&ratio), "{ratio} for {features:?}");
        }
    }

    #[test]
    fn the_weights_follow_a_change() {
        let mut model = Model::new(START);
        for n in 0..3000 {
            model.learn(&example(n), time(&example(n)));
        }
        for n in 0..20_000 {
            model.learn(&example(n), 3.0 * time(&example(n)));
        }
        let features = example(77);
        let ratio = model.predict(&features) / (3.0 * time(&features));
        assert!((0.9..1.1).contains(&ratio), "{ratio}");
    }

    #[test]
    fn odd_times_do_no_harm() {
        let mut model = Model::new(START);
        for n in 0..200 {
            let zeros = [0.0; COUNT];
            model.learn(if n % 2 == 0 { &zeros } else { &START }, [0.0, 1e9, 3.0, 1e-9][n % 4]);
            assert!(model.predict(&example(n as u32)).is_finite());
        }
    }
}
