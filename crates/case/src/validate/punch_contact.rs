//! The contact of a punch with the layer, in plane strain and in three dimensions.

use super::super::model::PunchContact;
use super::super::raw;
use super::super::reader::Read;

/// The contact of a punch with the layer; `None` if it could not be read.
pub(super) fn contact(raw: &Option<Read<raw::Contact>>) -> Option<PunchContact> {
    Some(match raw {
        Some(read) => match read.get()? {
            raw::Contact::Smooth => PunchContact::Smooth { corner_radius: None },
            raw::Contact::Bonded => PunchContact::Bonded,
            raw::Contact::Held => PunchContact::Held,
        },
        None => PunchContact::Smooth { corner_radius: None },
    })
}
