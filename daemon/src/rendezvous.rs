//! How the daemon is found, and how nothing of it is left behind.
//!
//! The instance's directory holds a lock file, which the living daemon keeps locked, the control socket, and
//! `daemon.json`. Everything that iceoryx2 makes carries a tag of that directory and the epoch of this start: whoever has
//! the lock knows that whatever else carries the tag belongs to a dead daemon, and removes it.

use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use collided_client::instance;
use collided_protocol::names::{LOCK_FILE, RENDEZVOUS_FILE, Rendezvous, SOCKET_FILE};
use collided_protocol::{ICEORYX2_VERSION, PROTOCOL_VERSION, PROTOCOL_VERSION_MIN, WireError};
use rustix::fs::{FlockOperation, flock};

const SHARED_MEMORY: &str = "/dev/shm";
/// Short and fixed: iceoryx2 puts sockets below it, whose paths the system limits to 108 bytes.
const ROOT_PARENT: &str = "/tmp";
/// A directory that is removed by a daemon that ends while another one starts is made again this often.
const ATTEMPTS: u32 = 100;

/// Why an instance could not be taken.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ClaimError {
    /// The instance's name cannot be used.
    #[error("{0}")]
    BadInstance(WireError),
    /// Another daemon has the instance.
    #[error(
        "instance {instance:?} is already served by process {holder} (lock {lock}); end it, or choose another --instance",
        lock = lock.display()
    )]
    Held {
        /// The instance.
        instance: String,
        /// The process id of its daemon.
        holder: String,
        /// The lock file.
        lock: PathBuf,
    },
    /// The directory belongs to another user: what is in it cannot be trusted.
    #[error("{path} belongs to user {owner}, not to this one; remove it, or set XDG_RUNTIME_DIR", path = path.display())]
    ForeignDirectory {
        /// The directory.
        path: PathBuf,
        /// Its owner's user id.
        owner: u32,
    },
    /// The file system refused.
    #[error("cannot {action} {path}: {cause}; check its rights and the free space", path = path.display())]
    Io {
        /// What was being done.
        action: &'static str,
        /// With what.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
}

fn io_error<'a>(action: &'static str, path: &'a Path) -> impl FnOnce(io::Error) -> ClaimError + 'a {
    move |cause| ClaimError::Io { action, path: path.to_owned(), cause }
}

/// An instance held by this process. Dropping it removes everything and lets the lock go.
#[derive(Debug)]
pub struct Claim {
    directory: PathBuf,
    tag: String,
    epoch: String,
    _lock: File,
}

impl Claim {
    /// Takes an instance: locks it, and removes what dead daemons have left of it.
    ///
    /// # Errors
    /// [`ClaimError::Held`] when a living daemon has it; else what the file system refused.
    pub fn take(instance: &str) -> Result<Claim, ClaimError> {
        let directory = instance::directory(instance).map_err(ClaimError::BadInstance)?;
        let lock = lock(instance, &directory)?;
        let tag = tag(&directory).map_err(io_error("look at", &directory))?;
        let claim = Claim { directory, tag, epoch: epoch(), _lock: lock };
        claim.wipe();
        let root = claim.root();
        DirBuilder::new().mode(0o700).create(&root).map_err(io_error("create", &root))?;
        Ok(claim)
    }

    /// Different for every start.
    pub fn epoch(&self) -> &str {
        &self.epoch
    }

    /// The instance's directory.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// Where the control socket belongs.
    pub fn socket(&self) -> PathBuf {
        self.directory.join(SOCKET_FILE)
    }

    /// What a client must know.
    pub fn rendezvous(&self) -> Rendezvous {
        Rendezvous {
            epoch: self.epoch.clone(),
            pid: std::process::id(),
            protocol_min: PROTOCOL_VERSION_MIN,
            protocol_max: PROTOCOL_VERSION,
            iceoryx2: ICEORYX2_VERSION.to_owned(),
            iceoryx2_prefix: format!("{}{}-", self.prefix(), self.epoch),
            iceoryx2_root: self.root().to_string_lossy().into_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
        }
    }

    /// Lets clients find the daemon. Called when everything that the file names is ready.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn publish(&self) -> Result<(), ClaimError> {
        let file = self.directory.join(RENDEZVOUS_FILE);
        let unfinished = file.with_extension("new");
        let json = serde_json::to_vec_pretty(&self.rendezvous()).map_err(|error| error.into());
        json.and_then(|json| fs::write(&unfinished, json)).map_err(io_error("write", &unfinished))?;
        fs::rename(&unfinished, &file).map_err(io_error("write", &file))
    }

    fn prefix(&self) -> String {
        format!("cld-{}-", self.tag)
    }

    fn root(&self) -> PathBuf {
        Path::new(ROOT_PARENT).join(format!("{}{}", self.prefix(), self.epoch))
    }

    /// Removes what any daemon of this instance has left, this one's included. What cannot be removed is left to the next.
    fn wipe(&self) {
        remove_iceoryx2_files(&self.prefix());
        for path in entries(&self.directory, |name| name != LOCK_FILE) {
            let _ = fs::remove_file(path);
        }
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        // The socket and daemon.json go first, so that nobody finds a daemon that is no longer there; the lock last, while
        // it is still held: who opened it before finds that it is no longer the one in the directory.
        self.wipe();
        let _ = fs::remove_file(self.directory.join(LOCK_FILE));
        let _ = fs::remove_dir(&self.directory);
        if let Some(parent) = self.directory.parent() {
            // Refused while other instances have a directory there.
            let _ = fs::remove_dir(parent);
        }
    }
}

/// What the living daemon of an instance has published, as far as it can be read.
pub fn published(instance: &str) -> Option<Rendezvous> {
    let directory = instance::directory(instance).ok()?;
    serde_json::from_slice(&fs::read(directory.join(RENDEZVOUS_FILE)).ok()?).ok()
}

/// Removes what is left of an instance whose daemon and clients have ended, and of an epoch of it. Does nothing to the
/// instance when a daemon lives there after all.
pub fn remove_remains(instance: &str, epoch: Option<&Rendezvous>) {
    if let Some(epoch) = epoch {
        remove_iceoryx2_files(&epoch.iceoryx2_prefix);
        remove_root(Path::new(&epoch.iceoryx2_root));
    }
    if instance::directory(instance).is_ok_and(|directory| directory.exists()) {
        drop(Claim::take(instance));
    }
}

fn remove_iceoryx2_files(prefix: &str) {
    for path in entries(Path::new(SHARED_MEMORY), |name| name.starts_with(prefix)) {
        let _ = fs::remove_file(path);
    }
    entries(Path::new(ROOT_PARENT), |name| name.starts_with(prefix)).iter().for_each(|path| remove_root(path));
}

fn remove_root(path: &Path) {
    if fs::symlink_metadata(path).is_ok_and(|metadata| metadata.is_dir() && is_own(&metadata)) {
        let _ = fs::remove_dir_all(path);
    }
}

fn entries(directory: &Path, wanted: impl Fn(&str) -> bool) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(directory) else { return Vec::new() };
    let wanted = |entry: &fs::DirEntry| entry.file_name().to_str().is_some_and(&wanted);
    entries.filter_map(Result::ok).filter(wanted).map(|entry| entry.path()).collect()
}

fn lock(instance: &str, directory: &Path) -> Result<File, ClaimError> {
    let path = directory.join(LOCK_FILE);
    for _ in 0..ATTEMPTS {
        create_directory(directory)?;
        match open_lock(&path) {
            Ok(file) if flock(&file, FlockOperation::NonBlockingLockExclusive).is_err() => {
                return Err(held(instance, file, path));
            }
            Ok(file) if is_at(&file, &path) => return record_pid(file).map_err(io_error("write", &path)),
            // A daemon that ended has removed the file, or its directory, in between.
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(io_error("open", &path)(error)),
        }
    }
    Err(io_error("lock", &path)(io::Error::other("it is removed again and again")))
}

fn create_directory(directory: &Path) -> Result<(), ClaimError> {
    for path in [directory.parent().unwrap_or(directory), directory] {
        DirBuilder::new().recursive(true).mode(0o700).create(path).map_err(io_error("create", path))?;
        match fs::symlink_metadata(path) {
            Ok(metadata) if metadata.is_dir() && is_own(&metadata) => {}
            Ok(metadata) => return Err(ClaimError::ForeignDirectory { path: path.to_owned(), owner: metadata.uid() }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(io_error("look at", path)(error)),
        }
    }
    Ok(())
}

fn is_own(metadata: &fs::Metadata) -> bool {
    metadata.uid() == rustix::process::getuid().as_raw()
}

fn open_lock(path: &Path) -> io::Result<File> {
    OpenOptions::new().read(true).write(true).create(true).truncate(false).mode(0o600).open(path)
}

fn is_at(file: &File, path: &Path) -> bool {
    match (file.metadata(), fs::metadata(path)) {
        (Ok(held), Ok(there)) => held.dev() == there.dev() && held.ino() == there.ino(),
        _ => false,
    }
}

fn record_pid(mut file: File) -> io::Result<File> {
    file.set_len(0)?;
    write!(file, "{}", std::process::id())?;
    Ok(file)
}

fn held(instance: &str, mut lock_file: File, lock: PathBuf) -> ClaimError {
    let mut holder = String::new();
    let known = lock_file.read_to_string(&mut holder).is_ok() && !holder.is_empty();
    let holder = if known { holder } else { "(not known yet)".to_owned() };
    ClaimError::Held { instance: instance.to_owned(), holder, lock }
}

/// Names the directory: by its path and its inode, so that containers that share `/dev/shm` but not their directories do
/// not take each other's files for leftovers. 40 bits of FNV-1a.
fn tag(directory: &Path) -> io::Result<String> {
    let metadata = fs::metadata(directory)?;
    let mut bytes = directory.as_os_str().as_encoded_bytes().to_vec();
    bytes.extend(metadata.dev().to_le_bytes());
    bytes.extend(metadata.ino().to_le_bytes());
    let hash = bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
    Ok(format!("{:010x}", (hash ^ (hash >> 40)) & 0xff_ffff_ffff))
}

fn epoch() -> String {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let mixed = (now.as_nanos() as u64 ^ u64::from(std::process::id()) << 40).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    format!("{:08x}", mixed >> 32)
}
