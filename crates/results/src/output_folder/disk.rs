//! Calls to the file system: syncing to disk, exchanging folders, locks.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The number of files synced at the same time, so that the disk writes its journal once for several of them.
/// Tuned: `cargo bench --bench curve`, every output.
const SYNCED_AT_ONCE: usize = 8;

/// Waits until the contents of these files are on the disk.
///
/// # Errors
/// A file that cannot be synced, with the reason.
pub(super) fn sync_files(files: &[PathBuf]) -> Result<(), (PathBuf, io::Error)> {
    let next = AtomicUsize::new(0);
    let failed = Mutex::new(None);
    let work = || {
        while let Some(file) = files.get(next.fetch_add(1, Ordering::Relaxed)) {
            if let Err(error) = sync_file(file)
                && let Ok(mut failed) = failed.lock()
            {
                failed.get_or_insert((file.clone(), error));
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..SYNCED_AT_ONCE.min(files.len()) {
            // If no thread can be started, this one does the work.
            let _ = std::thread::Builder::new().spawn_scoped(scope, work);
        }
        work();
    });
    failed.into_inner().ok().flatten().map_or(Ok(()), Err)
}

/// Waits until the content of a file is on the disk.
pub(super) fn sync_file(file: &Path) -> io::Result<()> {
    // Windows syncs only files that are open for writing.
    fs::OpenOptions::new().read(true).write(cfg!(windows)).open(file)?.sync_all()
}

/// Waits until the names in a folder are on the disk, on systems that have such a call.
pub(super) fn sync_folder(folder: &Path) -> io::Result<()> {
    if cfg!(windows) {
        return Ok(());
    }
    match File::open(folder)?.sync_all() {
        Err(error) if matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => {
            Ok(())
        }
        result => result,
    }
}

/// Exchanges the names of two folders in one step.
///
/// # Errors
/// [`io::ErrorKind::Unsupported`] where the system or the file system has no such call; otherwise the reason
/// of the failure.
pub(super) fn exchange(one: &Path, other: &Path) -> io::Result<()> {
    #[cfg(any(target_os = "linux", target_os = "macos"))]
    {
        use rustix::fs::{CWD, RenameFlags, renameat_with};
        use rustix::io::Errno;
        renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE).map_err(|error| match error {
            Errno::INVAL | Errno::NOSYS | Errno::NOTSUP => io::ErrorKind::Unsupported.into(),
            error => error.into(),
        })
    }
    #[cfg(not(any(target_os = "linux", target_os = "macos")))]
    {
        let _ = (one, other);
        Err(io::ErrorKind::Unsupported.into())
    }
}

/// Checks that files can be made in a folder.
///
/// # Errors
/// The reason why not.
pub(super) fn writable(folder: &Path) -> io::Result<()> {
    #[cfg(unix)]
    {
        use rustix::fs::{Access, access};
        Ok(access(folder, Access::WRITE_OK | Access::EXEC_OK)?)
    }
    #[cfg(not(unix))]
    {
        fs::metadata(folder).map(drop)
    }
}

/// Whether two paths lead to the same file.
pub(super) fn same_file(one: &Path, other: &Path) -> bool {
    identity(one).is_some_and(|one| Some(one) == identity(other))
}

/// Whether two folders are on the same disk, as far as the system says.
pub(super) fn same_disk(one: &Path, other: &Path) -> bool {
    identity(one).map(|i| i[0]) == identity(other).map(|i| i[0])
}

/// Whether a new folder would have the owner of the folder that it replaces.
pub(super) fn same_owner(one: &Path, other: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        let owner = |path: &Path| fs::metadata(path).map(|m| (m.uid(), m.gid())).ok();
        owner(one).is_some_and(|one| Some(one) == owner(other))
    }
    #[cfg(not(unix))]
    {
        let _ = (one, other);
        true
    }
}

/// The inode number of a folder; `None` on systems without such numbers.
pub(super) fn number(folder: &Path) -> Option<u64> {
    identity(folder).map(|[_, number]| number)
}

/// The device and inode number of a file, links not followed.
fn identity(path: &Path) -> Option<[u64; 2]> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        fs::symlink_metadata(path).map(|m| [m.dev(), m.ino()]).ok()
    }
    #[cfg(not(unix))]
    {
        let _ = path;
        None
    }
}

/// Locks a folder for this process, until the lock is dropped or the process ends, however it ends. `None` if
/// another process has the lock, or if that is unknown.
pub(super) fn lock(folder: &Path) -> Option<File> {
    let handle = File::open(folder).ok()?;
    handle.try_lock().ok().map(|()| handle)
}

/// Removes a folder of files. Anything that cannot be removed stays.
pub(super) fn remove_files(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let _ = fs::remove_file(entry.path());
    }
    let _ = fs::remove_dir(folder);
}
