//! The film or closed gap between an indenter and the layer where the two touch, and how thick it may be for
//! a tolerance.
//!
//! The boxes of layer and indenter cannot touch under a map. So either the surface of the layer is displaced
//! from the indenter by a film of the layer's material, or the metal of a punch or cylinder fills the contact
//! and the narrow end of the gap beside it.

use elastocap_case::Case;
use elastocap_geometry::scene::Role;

use crate::scene::indenter::{IndenterForm, Rounding};
use crate::scene::neutral::indenter_in_field;

/// Thicknesses of films, or of gaps that metal closes, over that of the layer. Not tuned: each is twice the
/// one before.
const THICKNESSES: [f64; 7] = [3.125e-4, 6.25e-4, 1.25e-3, 2.5e-3, 5e-3, 1e-2, 2e-2];

/// The index of the thinnest film: a thinner one distorts the space between indenter and layer so much that
/// the solver needs many iterations. Tuned: time and `geometry_error_estimate` of
/// `elastocap run cases/approach-to-touch.toml`.
const THINNEST_FILM: usize = 3;

/// The gap up to which an indenter and the layer under a film count as touching, over the thickness of the
/// film. Tuned: time and `geometry_error_estimate` of `elastocap run cases/approach-to-touch.toml`.
const TOUCHING: f64 = 0.3;

/// A film, or a gap that metal closes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Film {
    /// The thickness, m.
    pub(super) thickness: f64,
    /// Whether metal takes the place of the film, and closes the gap beside the contact where it is narrower.
    pub(super) is_closed: bool,
}

/// The films to try for a tolerance, in order: the thickest whose error is at most half the tolerance, then
/// thicker ones for maps that fold. Under metal, closed gaps of all thicknesses are tried first.
pub(crate) struct Films {
    relative_tolerance: f64,
    /// The thickness of the layer, m.
    layer: f64,
    /// The index in [`THICKNESSES`] of the film to try.
    index: usize,
    /// Whether metal closes the gap, and no film is between indenter and layer.
    is_closed: bool,
    /// Whether no map has failed yet, so that a thinner film may be tried.
    may_be_thinner: bool,
}

impl Films {
    /// The films under the indenter of a case.
    pub(crate) fn new(case: &Case, relative_tolerance: f64) -> Self {
        let indenter = indenter_in_field(case);
        let is_metal = indenter.is_some_and(|indenter| matches!(indenter.role, Role::Conductor { .. }));
        Self::of(case.layer.as_ref().map_or(0.0, |layer| layer.thickness), is_metal, relative_tolerance)
    }

    /// Starts with the thickest film whose error would be at most a quarter of the tolerance if the
    /// electrodes were one layer thickness away from it.
    fn of(layer: f64, is_closed: bool, relative_tolerance: f64) -> Self {
        let is_thin = |film: &f64| 0.5 * film <= 0.25 * relative_tolerance;
        let index = THICKNESSES.iter().rposition(is_thin).unwrap_or(0);
        let mut films = Self { relative_tolerance, layer, index, is_closed, may_be_thinner: true };
        films.index = films.index.max(films.thinnest());
        films
    }

    /// The index of the thinnest film that may be tried.
    fn thinnest(&self) -> usize {
        if self.is_closed { 0 } else { THINNEST_FILM }
    }

    /// The film to try; `None` after the thickest.
    pub(crate) fn next(&self) -> Option<Film> {
        let share = THICKNESSES.get(self.index)?;
        Some(Film { thickness: share * self.layer, is_closed: self.is_closed })
    }

    /// Moves on to a thinner film if the `error` of this one is too large and there is one. Returns whether
    /// it did.
    pub(crate) fn made_thinner(&mut self, error: f64) -> bool {
        let too_thick = error > 0.5 * self.relative_tolerance;
        let thinner = self.may_be_thinner && too_thick && self.index > self.thinnest();
        self.index -= usize::from(thinner);
        thinner
    }

    /// Moves on to a thicker film after the map with this one failed.
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
    /// There is no contact, or the indenter is a sharp box on the layer, which needs no film.
    Apart,
    /// They touch through a film of this thickness, m.
    Film(f64),
    /// Metal closes the gap where it is narrower than this, m.
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

    /// The largest gap that counts as contact, m.
    pub(super) fn touching(self) -> f64 {
        match self {
            Self::Apart => 0.0,
            Self::Film(thickness) => TOUCHING * thickness,
            Self::Closed(gap) => gap,
        }
    }

    /// The displacement of the surface from the indenter in a contact, m; `None` without contact.
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
        let mut tried = Vec::new();
        while let Some(film) = films.next() {
            tried.push((film.thickness, film.is_closed));
            films.make_thicker();
        }
        tried
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
