//! The steps of a case, whichever side it is of.

use serde::{Deserialize, Serialize};

/// A number that changes with the steps: linear between its values at some of them, constant beyond.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Course(pub Vec<(u32, f64)>);

impl Course {
    /// The number in a step.
    pub fn at(&self, step: u32) -> f64 {
        let after = self.0.partition_point(|(s, _)| *s <= step);
        match (after.checked_sub(1).map(|k| self.0[k]), self.0.get(after)) {
            (Some((from, a)), Some(&(to, b))) => {
                a + (b - a) * f64::from(step - from) / f64::from(to - from)
            }
            (Some((_, a)), None) => a,
            (None, Some(&(_, b))) => b,
            (None, None) => 0.0,
        }
    }
}

/// Steps of one length.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Epoch {
    /// In s; 0 in an opening or a closing step.
    pub dt: f64,
    /// Steps of each grant. The first step of an epoch is measured.
    pub windows: Vec<u32>,
    /// Whether the outlines are asked for in its first step.
    pub outlines: bool,
    /// Whether its first step is a frame.
    pub frame: bool,
    /// Whether the solver is saved before each grant, and goes on in a new one.
    pub resumed: bool,
}

impl Epoch {
    /// Number of steps.
    pub fn steps(&self) -> u32 {
        self.windows.iter().sum()
    }
}

/// Number of steps of all.
pub fn steps(epochs: &[Epoch]) -> u32 {
    epochs.iter().map(Epoch::steps).sum()
}

/// The same steps, each measured.
pub fn measured(epochs: &[Epoch]) -> Vec<Epoch> {
    let each = |epoch: &Epoch| {
        let epoch = epoch.clone();
        (0..epoch.steps()).map(move |k| Epoch {
            windows: vec![1],
            outlines: epoch.outlines && k == 0,
            ..epoch
        })
    };
    epochs.iter().flat_map(each).collect()
}

/// The first `left` steps, or those from there on.
pub fn parts(epochs: &[Epoch], mut left: u32) -> [Vec<Epoch>; 2] {
    let [mut head, mut tail] = [epochs.to_vec(), epochs.to_vec()];
    for (first, second) in head.iter_mut().zip(&mut tail) {
        for (a, b) in first.windows.iter_mut().zip(&mut second.windows) {
            *a = (*a).min(left);
            *b -= *a;
            left -= *a;
        }
    }
    for part in [&mut head, &mut tail] {
        for epoch in &mut *part {
            epoch.windows.retain(|window| *window > 0);
        }
        part.retain(|epoch| !epoch.windows.is_empty());
    }
    [head, tail]
}

/// Simpler steps, to be tried where `step` fails: the boldest first.
pub fn simpler(epochs: &[Epoch], step: u32) -> Vec<Vec<Epoch>> {
    let mut simpler = vec![parts(epochs, step + 1)[0].clone()];
    if let Some(epoch) = epochs.iter().find(|epoch| epoch.dt > 0.0).cloned() {
        let windows = vec![steps(epochs)];
        simpler.push(vec![Epoch { windows, ..epoch }]);
    }
    let changes: [fn(&mut Epoch); 5] = [
        |e| (e.outlines, e.frame, e.resumed) = (false, false, false),
        |e| e.resumed = false,
        |e| e.frame = false,
        |e| e.outlines = false,
        |e| e.windows = vec![e.steps()],
    ];
    for change in changes {
        let mut other = epochs.to_vec();
        other.iter_mut().for_each(change);
        simpler.push(other);
    }
    simpler
}
