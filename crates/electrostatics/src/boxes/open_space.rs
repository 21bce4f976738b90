//! The distance to which a grid reaches into open space before rays to infinity begin, and the error that
//! this causes.

use crate::boxes::layout::Layout;
use crate::floating::Floating;
use crate::solution::Settings;

/// Open space around a layout.
pub(crate) struct OpenSpace {
    /// Terms `factor / distance^power`: the largest is the relative spread of the target due to the distance
    /// at which rays begin. Empty in a closed scene.
    falls: Vec<(f64, f64)>,
    /// Share of the tolerance that is allowed for this spread.
    share: f64,
}

/// The factor in [`OpenSpace::falls`] for the capacitance of one conductor. Measured:
/// `cargo bench --bench targets` (the isolated cube).
const ALONE: f64 = 0.27;

/// The factor in [`OpenSpace::falls`] for the entries of a matrix, whose relative errors may be several times
/// as large as that of one conductor. Measured on FastCap's bus crossings: `benches/outlines.py bus`.
const COUPLED: f64 = 2.0;

impl OpenSpace {
    /// The open space around a layout, for the target of the settings.
    ///
    /// For two terminals, whose field has no net charge, the factor was measured on two plates, and on an
    /// electrode pair in an infinite layer of relative permittivity 1 to 80. The factor for a net charge was
    /// measured on a cube next to a small one, the factor for rays through different permittivities on a cube
    /// on a slab.
    pub(crate) fn new(layout: &Layout, floating: &Floating, settings: &Settings) -> Self {
        let falls = match (layout.endless_contrast(), floating.is_neutral(settings.target)) {
            (None, _) => Vec::new(),
            (Some(contrast), true) => vec![(0.15 * contrast.powf(0.7), 3.0)],
            (Some(contrast), false) => {
                let straight = if layout.conductors.len() > 1 { COUPLED } else { ALONE };
                vec![(straight, 3.0), (0.32 * (contrast - 1.0).min(10.0), 1.8)]
            }
        };
        // An estimate counts this error as often as entries of a matrix amplify it, so that a smaller share
        // is allowed.
        Self { falls, share: if settings.bounds { 0.3 } else { 0.1 } }
    }

    /// The distance at which rays begin for a tolerance: from the pole, over the distance of the farthest
    /// conductor.
    pub(crate) fn distance(&self, tolerance: f64) -> f64 {
        let left = self.share * tolerance;
        self.falls.iter().map(|(factor, power)| (factor / left).powf(1.0 / power)).fold(0.0, f64::max)
    }

    /// Relative spread of the target where rays begin at this distance.
    pub(crate) fn error(&self, distance: f64) -> f64 {
        self.falls.iter().map(|(factor, power)| factor * distance.powf(-power)).fold(0.0, f64::max)
    }

    /// Whether the scene is closed, so that no ray leaves it.
    pub(crate) fn is_closed(&self) -> bool {
        self.falls.is_empty()
    }
}
