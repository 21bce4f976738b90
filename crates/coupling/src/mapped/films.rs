//! The film or closed gap between an indenter and the layer where the two touch, and how thick it may be for a tolerance.
//!
//! The boxes of the two would need a gap between them that is not there. Either the surface of the layer is moved away from the indenter by
//! a film of the layer's material, or the metal of a punch or cylinder fills the contact and the narrow end of the gap beside it.

use elastocap_case::Case;
use elastocap_geometry::scene::Role;

use crate::scene::indenter::{IndenterForm, Rounding};
use crate::scene::neutral::indenter_in_field;

/// Thicknesses of films, or of gaps that metal closes, over that of the layer.
const THICKNESSES: [f64; 7] = [3.125e-4, 6.25e-4, 1.25e-3, 2.5e-3, 5e-3, 1e-2, 2e-2];

/// The first of them that a film has: a thinner one bends the space between indenter and layer so much that iterations become many.
const THINNEST_FILM: usize = 3;

/// An indenter and the layer under a film touch where they are closer than this share of the film.
const TOUCHING: f64 = 0.3;

/// A film, or a gap that metal closes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Film {
    /// The thickness, m.
    pub(super) thickness: f64,
    /// Whether metal takes its place, and closes the gap beside the contact where that is narrower.
    pub(super) is_closed: bool,
}

/// The films to try for a tolerance, one after the other: the thickest whose error is at most half the tolerance, and then thicker ones,
/// for maps whose polynomials cross over it. Under metal all of them are closed gaps first.
pub(crate) struct Films {
    relative_tolerance: f64,
    /// The thickness of the layer, m.
    layer: f64,
    index: usize,
    is_closed: bool,
    /// Whether no map failed yet.
    may_be_thinner: bool,
}

impl Films {
    /// The films under the indenter of a case.
    pub(crate) fn new(case: &Case, relative_tolerance: f64) -> Self {
        let indenter = indenter_in_field(case);
        let is_metal = indenter.is_some_and(|own| matches!(own.role, Role::Conductor { .. }));
        Self::of(case.layer.as_ref().map_or(0.0, |layer| layer.thickness), is_metal, relative_tolerance)
    }

    /// The first is the thickest whose error would be a quarter of the tolerance with the layer as thin as the electrodes' cover.
    fn of(layer: f64, is_closed: bool, relative_tolerance: f64) -> Self {
        let is_thin = |film: &f64| 0.5 * film <= 0.25 * relative_tolerance;
        let index = THICKNESSES.iter().rposition(is_thin).unwrap_or(0);
        let mut own = Self { relative_tolerance, layer, index, is_closed, may_be_thinner: true };
        own.index = own.index.max(own.thinnest());
        own
    }

    fn thinnest(&self) -> usize {
        if self.is_closed { 0 } else { THINNEST_FILM }
    }

    /// The film to try; `None` after the thickest.
    pub(crate) fn next(&self) -> Option<Film> {
        let share = THICKNESSES.get(self.index)?;
        Some(Film { thickness: share * self.layer, is_closed: self.is_closed })
    }

    /// Takes a thinner one if the `error` that it leaves is too large and there is one. Returns whether it did.
    pub(crate) fn made_thinner(&mut self, error: f64) -> bool {
        let too_thick = error > 0.5 * self.relative_tolerance;
        let thinner = self.may_be_thinner && too_thick && self.index > self.thinnest();
        self.index -= usize::from(thinner);
        thinner
    }

    /// Takes a thicker one, since the map with this one failed.
    pub(crate) fn make_thicker(&mut self) {
        self.may_be_thinner = false;
        self.index += 1;
        if self.is_closed && self.index == THICKNESSES.len() {
            *self = Self::of(self.layer, false, self.relative_tolerance);
        }
    }
}

/// How an indenter and the layer touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Contact {
    /// Not at all, or a box lies on the layer.
    Apart,
    /// Through a film of this thickness, m.
    Film(f64),
    /// Wherever the gap is narrower than this, m: metal closes it.
    Closed(f64),
}

impl Contact {
    /// The contact of an indenter of this form, given the width of the gap in its middle, m.
    pub(super) fn of(form: &IndenterForm, film: Film, gap: f64) -> Self {
        match form.rounding {
            _ if gap >= 0.5 * film.thickness => Self::Apart,
            Rounding::Sharp => Self::Apart,
            Rounding::AlongX3 { .. } if film.is_closed => Self::Closed(film.thickness),
            Rounding::AlongX3 { .. } | Rounding::Ball { .. } => Self::Film(film.thickness),
        }
    }

    /// Up to which gap the two touch, m.
    pub(super) fn touching(self) -> f64 {
        match self {
            Self::Apart => 0.0,
            Self::Film(thickness) => TOUCHING * thickness,
            Self::Closed(gap) => gap,
        }
    }

    /// By how much the surface is moved away where the two touch, m; `None` if they do not.
    pub(super) fn moved(self) -> Option<f64> {
        match self {
            Self::Apart => None,
            Self::Film(thickness) => Some(thickness),
            Self::Closed(_) => Some(0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tried(is_metal: bool) -> Vec<(f64, bool)> {
        let mut films = Films::of(1.0, is_metal, 1e-2);
        let mut all = Vec::new();
        while let Some(film) = films.next() {
            all.push((film.thickness, film.is_closed));
            films.make_thicker();
        }
        all
    }

    #[test]
    fn where_no_gap_can_be_closed_films_are_tried_until_there_is_no_thicker_one() {
        let films = [(5e-3, false), (1e-2, false), (2e-2, false)];
        assert_eq!(tried(false), films);
        assert_eq!(tried(true), [films.map(|(film, _)| (film, true)), films].concat());
    }

    #[test]
    fn closed_gaps_become_thinner_than_films_where_their_error_is_too_large() {
        let thinnest = |is_metal: bool| {
            let mut films = Films::of(1.0, is_metal, 1e-2);
            while films.made_thinner(6e-3) {}
            assert!(!films.made_thinner(4e-3));
            films.next().map(|film| film.thickness)
        };
        assert_eq!((thinnest(false), thinnest(true)), (Some(2.5e-3), Some(3.125e-4)));
    }
}
