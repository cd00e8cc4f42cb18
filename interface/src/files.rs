//! The only way to the files of a run directory, and to those that a user names.
//!
//! A run directory may come from somebody else, with anything in the place of its files. So what is opened beneath a
//! directory is never reached by a link, is a regular file, and is not read beyond a size. No opening waits, as that of a
//! pipe does. A file that is written has no second name (hard link), under which it would change too.
//!
//! The directory itself, and a file that the user names, may be reached by links: there the user has chosen the file.
//! `clippy.toml` forbids every other way to open one. The few places that do, those of `/proc` and of the private directory
//! of a run's shared memory, allow it with their reason.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::os::fd::OwnedFd;
use std::path::{Component, Path};

use rustix::fs::{
    AtFlags, CWD, Dir, FileType, Mode, OFlags, Stat, fstat, mkdirat, openat, renameat, statat,
    unlinkat,
};
use rustix::io::Errno;

/// Largest size in bytes of a file that is read as a whole: a scene, a summary, a list, a log.
pub const SMALL: u64 = 64 << 20;
/// The same of a table or a frame.
pub const TABLE: u64 = 512 << 20;
/// The same of the state of a run.
pub const STATE: u64 = 8 << 30;

/// What a file is opened for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum How {
    /// To read it.
    Read,
    /// To read and write it; it has to exist.
    Change,
    /// The same; it is made if it is missing.
    Make,
    /// To add to its end; it is made if it is missing.
    Append,
    /// To write it anew.
    Replace,
}

impl How {
    fn flags(self) -> OFlags {
        let how = match self {
            Self::Read => OFlags::RDONLY,
            Self::Change => OFlags::RDWR,
            Self::Make => OFlags::RDWR | OFlags::CREATE,
            Self::Append => OFlags::WRONLY | OFlags::APPEND | OFlags::CREATE,
            Self::Replace => OFlags::WRONLY | OFlags::CREATE | OFlags::EXCL,
        };
        how | OFlags::NOFOLLOW | AT_ONCE
    }
}

/// Flags of every opening. The flag against waiting has no effect on a regular file that is open.
const AT_ONCE: OFlags = OFlags::NONBLOCK
    .union(OFlags::NOCTTY)
    .union(OFlags::CLOEXEC);
/// Flags of the folders on the way to a file.
const FOLDER: OFlags = OFlags::PATH.union(OFlags::DIRECTORY).union(OFlags::CLOEXEC);
/// Mode of new files and folders before the umask.
const FILE_MODE: Mode = Mode::from_raw_mode(0o666);
const FOLDER_MODE: Mode = Mode::from_raw_mode(0o777);

fn refused(what: impl Into<String>) -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, what.into())
}

/// Opens the file `name` beneath `dir`.
///
/// # Errors
/// Those of the system; [`ErrorKind::InvalidInput`] where something else than a regular file is in its place, or a link is
/// on the way to it.
pub fn open(dir: &Path, name: impl AsRef<Path>, how: How) -> io::Result<File> {
    let (folder, name) = descend(dir, name.as_ref(), false)?;
    open_in(&folder, name, how)
}

fn open_in(folder: &OwnedFd, name: &OsStr, how: How) -> io::Result<File> {
    if let Some(there) = status(folder, name)? {
        regular(&there)?;
        if how == How::Replace {
            // Whoever has it open, or has another name for it, keeps it as it is.
            unlinkat(folder, name, AtFlags::empty())?;
        }
    }
    let file = File::from(openat(folder, name, how.flags(), FILE_MODE)?);
    let there = fstat(&file)?;
    regular(&there)?;
    if how != How::Read && there.st_nlink > 1 {
        return Err(refused(
            "it has a second name (hard link), under which it would change too; copy it",
        ));
    }
    Ok(file)
}

/// The folder of a file beneath `dir`, and the file's name in it. Missing folders are made where `make` is set.
fn descend<'a>(dir: &Path, name: &'a Path, make: bool) -> io::Result<(OwnedFd, &'a OsStr)> {
    let mut folder = base(dir)?;
    let mut parts = name.components().peekable();
    while let Some(part) = parts.next() {
        let Component::Normal(part) = part else {
            break;
        };
        if parts.peek().is_none() {
            return Ok((folder, part));
        }
        if make {
            match mkdirat(&folder, part, FOLDER_MODE) {
                Ok(()) | Err(Errno::EXIST) => {}
                Err(error) => return Err(error.into()),
            }
        }
        let below = openat(&folder, part, FOLDER | OFlags::NOFOLLOW, Mode::empty());
        folder = below.map_err(|error| match error {
            Errno::NOTDIR | Errno::LOOP => refused(format!("`{}` is not a folder", part.display())),
            error => error.into(),
        })?;
    }
    Err(refused("it is not the name of a file in the directory"))
}

/// The directory beneath which files are opened.
fn base(dir: &Path) -> io::Result<OwnedFd> {
    let dir = if dir.as_os_str().is_empty() {
        Path::new(".")
    } else {
        dir
    };
    Ok(openat(CWD, dir, FOLDER, Mode::empty())?)
}

/// What is in a place; `None` where nothing is.
fn status(folder: &OwnedFd, name: &OsStr) -> io::Result<Option<Stat>> {
    match statat(folder, name, AtFlags::SYMLINK_NOFOLLOW) {
        Ok(there) => Ok(Some(there)),
        Err(Errno::NOENT) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

fn regular(there: &Stat) -> io::Result<()> {
    let what = match FileType::from_raw_mode(there.st_mode) {
        FileType::RegularFile => return Ok(()),
        FileType::Symlink => "a symbolic link",
        FileType::Directory => "a directory",
        FileType::Fifo => "a pipe",
        FileType::Socket => "a socket",
        _ => "a device",
    };
    Err(refused(format!("it is {what}, not a regular file")))
}

/// Reads the file `name` beneath `dir`, of at most `most` bytes.
///
/// # Errors
/// As [`open`]; the file is longer.
pub fn read(dir: &Path, name: impl AsRef<Path>, most: u64) -> io::Result<Vec<u8>> {
    whole(open(dir, name, How::Read)?, most)
}

/// The same of a text.
///
/// # Errors
/// As [`read`]; the file is not UTF-8.
pub fn read_text(dir: &Path, name: impl AsRef<Path>, most: u64) -> io::Result<String> {
    text(read(dir, name, most)?)
}

/// What is in an open file of at most `most` bytes.
fn whole(file: File, most: u64) -> io::Result<Vec<u8>> {
    let too_long = |bytes| refused(format!("it has {bytes} bytes; at most {most} are read"));
    let bytes = file.metadata()?.len();
    if bytes > most {
        return Err(too_long(bytes));
    }
    let mut content = Vec::with_capacity(bytes as usize);
    // It may grow meanwhile.
    file.take(most + 1).read_to_end(&mut content)?;
    if content.len() as u64 > most {
        return Err(too_long(content.len() as u64));
    }
    Ok(content)
}

fn text(bytes: Vec<u8>) -> io::Result<String> {
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        io::Error::new(
            ErrorKind::InvalidData,
            format!("it is not text: byte {at} is not UTF-8"),
        )
    })
}

/// What is in the place `name` beneath `dir`; `None` where nothing is.
fn found(dir: &Path, name: &Path) -> io::Result<Option<Stat>> {
    let found = descend(dir, name, false).and_then(|(folder, name)| status(&folder, name));
    match found {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        found => found,
    }
}

/// Replaces the file `name` beneath `dir`, in folders that are made where they are missing: a reader sees the old file or
/// the new one, never a part. If `durably`, it is on the disk when this returns.
///
/// # Errors
/// As [`open`].
pub fn replace(dir: &Path, name: impl AsRef<Path>, bytes: &[u8], durably: bool) -> io::Result<()> {
    let (folder, name) = descend(dir, name.as_ref(), true)?;
    if let Some(there) = status(&folder, name)? {
        regular(&there)?;
    }
    let part = Path::new(name).with_added_extension("part");
    let mut file = open_in(&folder, part.as_os_str(), How::Replace)?;
    let mut write = || -> io::Result<()> {
        file.write_all(bytes)?;
        if durably {
            file.sync_all()?;
        }
        renameat(&folder, &part, &folder, name)?;
        if durably {
            File::from(openat(
                &folder,
                ".",
                OFlags::DIRECTORY | AT_ONCE,
                Mode::empty(),
            )?)
            .sync_all()?;
        }
        Ok(())
    };
    write().inspect_err(|_| {
        let _ = unlinkat(&folder, &part, AtFlags::empty());
    })
}

/// Whether `name` is a regular file beneath `dir`, reached by no link.
///
/// # Errors
/// Something else is there; `Ok(false)` where nothing is.
pub fn is_regular(dir: &Path, name: impl AsRef<Path>) -> io::Result<bool> {
    match found(dir, name.as_ref())? {
        Some(there) => regular(&there).map(|()| true),
        None => Ok(false),
    }
}

/// Whether anything is in the place `name` beneath `dir`, be it a link that leads nowhere.
pub fn is_there(dir: &Path, name: impl AsRef<Path>) -> bool {
    found(dir, name.as_ref()).is_ok_and(|there| there.is_some())
}

/// Refuses a link in the place of the folder `name` beneath `dir`.
///
/// # Errors
/// It is a link.
pub fn no_link(dir: &Path, name: impl AsRef<Path>) -> io::Result<()> {
    match found(dir, name.as_ref())? {
        Some(there) if FileType::from_raw_mode(there.st_mode) == FileType::Symlink => {
            Err(refused("it is a symbolic link, not a folder"))
        }
        _ => Ok(()),
    }
}

/// The names in the folder `name` beneath `dir`, sorted; none if there is no folder.
///
/// # Errors
/// A link or a file is in its place, or it cannot be read.
pub fn names(dir: &Path, name: impl AsRef<Path>) -> io::Result<Vec<String>> {
    let read = || -> io::Result<Vec<String>> {
        let (folder, name) = descend(dir, name.as_ref(), false)?;
        let flags = OFlags::DIRECTORY | OFlags::NOFOLLOW | AT_ONCE;
        let folder = openat(&folder, name, flags, Mode::empty()).map_err(|error| match error {
            Errno::NOTDIR | Errno::LOOP => refused("it is not a folder"),
            error => error.into(),
        })?;
        let mut names = Vec::new();
        for entry in Dir::new(folder)? {
            let name = entry?.file_name().to_string_lossy().into_owned();
            if name != "." && name != ".." {
                names.push(name);
            }
        }
        names.sort();
        Ok(names)
    };
    match read() {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(Vec::new()),
        read => read,
    }
}

/// Moves a file beneath `dir` to another place there, in folders that are made where they are missing. A missing file is
/// no error, and a link is moved as it is.
///
/// # Errors
/// Those of the system; a link is on the way.
pub fn rename(dir: &Path, from: impl AsRef<Path>, to: impl AsRef<Path>) -> io::Result<()> {
    let (to_folder, to) = descend(dir, to.as_ref(), true)?;
    let moved = descend(dir, from.as_ref(), false)
        .and_then(|(folder, from)| Ok(renameat(&folder, from, &to_folder, to)?));
    match moved {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        moved => moved,
    }
}

/// Removes the file `name` beneath `dir`, or the link that is in its place.
///
/// # Errors
/// Those of the system; a link is on the way.
pub fn remove(dir: &Path, name: impl AsRef<Path>) -> io::Result<()> {
    let (folder, name) = descend(dir, name.as_ref(), false)?;
    Ok(unlinkat(&folder, name, AtFlags::empty())?)
}

/// Removes the folder `name` beneath `dir` if it is empty.
///
/// # Errors
/// Those of the system; a link is on the way.
pub fn remove_folder(dir: &Path, name: impl AsRef<Path>) -> io::Result<()> {
    let (folder, name) = descend(dir, name.as_ref(), false)?;
    Ok(unlinkat(&folder, name, AtFlags::REMOVEDIR)?)
}

/// Opens a file that the user names, to read it.
///
/// # Errors
/// Those of the system; it is not a regular file.
pub fn open_named(path: &Path) -> io::Result<File> {
    named(path, OFlags::RDONLY)
}

/// Reads a file that the user names, of at most `most` bytes.
///
/// # Errors
/// As [`open_named`]; the file is longer.
pub fn read_named(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    whole(open_named(path)?, most)
}

/// The same of a text.
///
/// # Errors
/// As [`read_named`]; the file is not UTF-8.
pub fn read_named_text(path: &Path, most: u64) -> io::Result<String> {
    text(read_named(path, most)?)
}

/// Opens a file that the user names, to write it anew.
///
/// # Errors
/// As [`open_named`].
pub fn make_named(path: &Path) -> io::Result<File> {
    let file = named(path, OFlags::WRONLY | OFlags::CREATE)?;
    file.set_len(0)?;
    Ok(file)
}

/// Opens a file that the user names, to add to its end.
///
/// # Errors
/// As [`open_named`].
pub fn append_named(path: &Path) -> io::Result<File> {
    named(path, OFlags::WRONLY | OFlags::APPEND)
}

/// Writes a file that the user names.
///
/// # Errors
/// As [`make_named`].
pub fn write_named(path: &Path, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    make_named(path)?.write_all(bytes.as_ref())
}

/// Writes a file that the user names and that does not exist yet.
///
/// # Errors
/// As [`make_named`]; it exists.
pub fn write_new_named(path: &Path, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    let flags = OFlags::WRONLY | OFlags::CREATE | OFlags::EXCL;
    File::from(openat(CWD, path, flags | AT_ONCE, FILE_MODE)?).write_all(bytes.as_ref())
}

fn named(path: &Path, flags: OFlags) -> io::Result<File> {
    match statat(CWD, path, AtFlags::empty()) {
        Ok(there) => regular(&there)?,
        Err(Errno::NOENT) => {}
        Err(error) => return Err(error.into()),
    }
    let file = File::from(openat(CWD, path, flags | AT_ONCE, FILE_MODE)?);
    regular(&fstat(&file)?)?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::fs::mknodat;
    use std::fs;
    use std::os::unix::fs::symlink;

    const WRITES: [How; 4] = [How::Change, How::Make, How::Append, How::Replace];

    fn pipe(path: &Path) {
        mknodat(CWD, path, FileType::Fifo, Mode::from_raw_mode(0o600), 0).unwrap();
    }

    #[test]
    fn nothing_beneath_a_directory_is_reached_by_a_link() {
        let place = tempfile::tempdir().unwrap();
        let (dir, outside) = (place.path().join("run"), place.path().join("outside"));
        fs::create_dir_all(&dir).unwrap();
        fs::create_dir_all(&outside).unwrap();
        fs::write(outside.join("mine"), "mine").unwrap();
        symlink(outside.join("mine"), dir.join("file")).unwrap();
        symlink(outside.join("new"), dir.join("nowhere")).unwrap();
        symlink(&outside, dir.join("folder")).unwrap();
        for name in [
            "file",
            "nowhere",
            "folder/mine",
            "folder/new",
            "../outside/mine",
            "/etc/passwd",
        ] {
            for how in [How::Read].iter().chain(&WRITES) {
                let error = open(&dir, name, *how).unwrap_err();
                assert_eq!(
                    error.kind(),
                    ErrorKind::InvalidInput,
                    "{name} {how:?}: {error}"
                );
            }
            let error = replace(&dir, name, b"x", false).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::InvalidInput, "{name}: {error}");
        }
        rename(&dir, "file", "folder/mine").unwrap_err();
        remove(&dir, "folder/mine").unwrap_err();
        names(&dir, "folder").unwrap_err();
        assert!(!is_there(&dir, "folder/mine") && is_there(&dir, "nowhere"));
        assert_eq!(fs::read(outside.join("mine")).unwrap(), b"mine");
        assert_eq!(fs::read_dir(&outside).unwrap().count(), 1);
        // The directory itself and what the user names may be links.
        symlink(&dir, place.path().join("also")).unwrap();
        replace(&place.path().join("also"), "a/b", b"x", true).unwrap();
        assert_eq!(read(&dir, "a/b", 1).unwrap(), b"x");
        assert_eq!(read_named_text(&dir.join("file"), SMALL).unwrap(), "mine");
    }

    #[test]
    fn what_is_no_regular_file_is_refused_at_once() {
        let place = tempfile::tempdir().unwrap();
        let dir = place.path();
        pipe(&dir.join("pipe"));
        fs::create_dir(dir.join("folder")).unwrap();
        for name in ["pipe", "folder"] {
            for how in [How::Read].iter().chain(&WRITES) {
                let error = open(dir, name, *how).unwrap_err().to_string();
                assert!(error.contains("not a regular file"), "{error}");
            }
            replace(dir, name, b"x", false).unwrap_err();
            assert!(is_regular(dir, name).is_err());
            read_named(&dir.join(name), SMALL).unwrap_err();
            write_named(&dir.join(name), b"x").unwrap_err();
        }
        for device in ["/dev/zero", "/dev/full"] {
            let error = read_named(Path::new(device), SMALL).unwrap_err();
            assert_eq!(error.to_string(), "it is a device, not a regular file");
            write_named(Path::new(device), b"x").unwrap_err();
        }
        assert_eq!(fs::read_dir(dir).unwrap().count(), 2);
    }
}
