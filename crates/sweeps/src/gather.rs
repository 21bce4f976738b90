//! Joins the shards of a sweep into a folder as a single run would have made it.

use std::path::{Path, PathBuf};

use crate::error::SweepError;
use crate::folder::{SweepFolder, finished};
use crate::manifest::Manifest;
use crate::results::{Summary, write_results};
use crate::shard::Shard;

/// Joins the folders of all shards of a sweep in a new folder. Records are read and checked, and copied with
/// the rest.
///
/// # Errors
/// A folder without a sweep, folders of different sweeps, a shard that is given twice, missing or unfinished,
/// or an output folder that holds other files or is not writable. Then nothing was written.
pub fn gather(folders: &[PathBuf], into: &Path, overwrite: bool) -> Result<Summary, SweepError> {
    let mut shards: Vec<(&Path, Manifest)> = Vec::new();
    for folder in folders {
        let manifest = Manifest::read(folder)?.ok_or_else(|| SweepError::NoSweep {
            folder: folder.clone(),
            why: "it has no manifest.json; name the folder that `elastocap sweep --shard` has written to"
                .to_owned(),
        })?;
        if let Some((first, known)) = shards.first() {
            let mut differences = known.fingerprint.differences(&manifest.fingerprint);
            if differences.is_empty() && known.shard.of != manifest.shard.of {
                differences.push(format!("{} shards instead of {}", manifest.shard.of, known.shard.of));
            }
            if !differences.is_empty() || known.digest != manifest.digest {
                let (first, second) = (first.to_path_buf(), folder.clone());
                return Err(SweepError::ShardsDiffer { first, second, differences });
            }
        }
        if let Some((first, known)) = shards.iter().find(|(_, known)| known.shard == manifest.shard) {
            let (first, second) = (first.to_path_buf(), folder.clone());
            return Err(SweepError::ShardTwice { first, second, shard: known.shard });
        }
        shards.push((folder, manifest));
    }
    let Some((_, first_manifest)) = shards.first() else {
        return Err(SweepError::ShardsMissing { missing: vec![1], of: 1 });
    };
    let count = first_manifest.shard.of;
    let is_present = |number: &usize| shards.iter().any(|(_, manifest)| manifest.shard.number == *number);
    let missing: Vec<usize> = (1..=count).filter(|number| !is_present(number)).collect();
    if !missing.is_empty() {
        return Err(SweepError::ShardsMissing { missing, of: count });
    }
    let manifest = Manifest { shard: Shard::WHOLE, ..first_manifest.clone() };
    let mut records = vec![None; manifest.cases.len()];
    for (folder, shard_manifest) in &shards {
        let found = finished(folder, shard_manifest);
        let cases: Vec<usize> = shard_manifest.cases_of_shard().collect();
        let absent: Vec<usize> = cases
            .iter()
            .copied()
            .filter(|case| found.records.get(*case).is_none_or(Option::is_none))
            .collect();
        if let Some(first) = absent.first() {
            return Err(SweepError::ShardUnfinished {
                folder: folder.to_path_buf(),
                shard: shard_manifest.shard,
                missing: absent.len(),
                count: cases.len(),
                first: *first,
            });
        }
        for (place, record) in records.iter_mut().zip(found.records) {
            if record.is_some() {
                *place = record;
            }
        }
    }
    let folder = SweepFolder::open(into, manifest, overwrite)?;
    for record in records.iter().flatten() {
        folder.save(record)?;
    }
    write_results(&folder, &records)
}
