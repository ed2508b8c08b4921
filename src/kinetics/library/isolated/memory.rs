//! Memory that two processes share, and how one hands a part of it over to the other.
//!
//! It consists of lanes: each is used by one thread on either side at
//! a time, and grows as its calls need it. A lane begins with a [`Head`]; whose turn it is stands
//! there. Who waits for its turn looks again and again for as long as a short call takes, then
//! offers the core to others, and then sleeps until it is woken.

use std::fs::File;
use std::io;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::ptr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::descriptor::Location;

/// Bytes of the address space of a lane; what is not written to needs no memory.
const LANE_BYTES: usize = 1 << 34;
/// Bytes before the data of a lane.
pub(super) const LANE_HEADER_BYTES: usize = 4096;
/// Bytes of a lane at the start.
const INITIAL_LANE_BYTES: usize = 1 << 16;

/// Looks before cores are offered to others, and before sleep.
const SPINS_BEFORE_YIELD: u32 = 200;
const YIELDS_BEFORE_SLEEP: u32 = 20;

/// No request is pending, or the answer was taken.
pub(super) const IDLE: u32 = 0;
/// The child is to work.
pub(super) const REQUESTED: u32 = 1;
/// The parent is to read.
pub(super) const ANSWERED: u32 = 2;

/// Who waits for a turn.
const CHILD: usize = 0;
const PARENT: usize = 1;

fn waiter(turn: u32) -> usize {
    if turn == REQUESTED { CHILD } else { PARENT }
}

/// Calls by their numbers in a [`Head`].
pub(super) const CALLS: [&str; 13] = [
    "loading",
    "create",
    "typical",
    "rates",
    "rate_partials",
    "length_factor",
    "length_factor_partials",
    "curvature",
    "curvature_partials",
    "length_factor_across",
    "length_factor_across_partials",
    "observe",
    "destroy",
];
/// Locations by their numbers in a [`Head`].
pub(super) const LOCATIONS: [Location; 3] = [Location::Vertex, Location::Face, Location::Edge];

/// What both sides know of a call.
#[repr(C)]
#[derive(Debug, Default)]
pub(super) struct Head {
    turn: AtomicU32,
    /// Whether the child sleeps until it is asked, and the parent until there is an answer.
    asleep: [AtomicU32; 2],
    /// Which call, and where its points are.
    pub(super) call: AtomicU32,
    pub(super) location: AtomicU32,
    /// Number of the law.
    pub(super) law: AtomicU64,
    pub(super) first: AtomicU64,
    pub(super) count: AtomicU64,
    /// Columns of species, signals, parameters, values, partials.
    pub(super) columns: [AtomicU64; 5],
    /// Bytes of a text at the start of the data: of what is asked for, then of the answer.
    pub(super) text: AtomicU64,
}

/// The file behind the memory.
#[derive(Debug, Clone)]
pub(super) struct Memory(Arc<OwnedFd>);

impl Memory {
    /// For so many lanes.
    pub(super) fn new(lanes: usize) -> io::Result<Self> {
        // SAFETY: the name ends with a zero.
        let file = unsafe {
            libc::memfd_create(c"plugin".as_ptr(), libc::MFD_CLOEXEC | libc::MFD_ALLOW_SEALING)
        };
        if file < 0 {
            return Err(io::Error::last_os_error());
        }
        // SAFETY: just opened, and not shared.
        let file = unsafe { File::from_raw_fd(file) };
        file.set_len(u64::try_from(lanes * LANE_BYTES).unwrap_or(u64::MAX))?;
        let seals = libc::F_SEAL_SHRINK | libc::F_SEAL_GROW | libc::F_SEAL_SEAL;
        // SAFETY: the file is open. Without its end no access can fail that was possible before.
        if unsafe { libc::fcntl(file.as_raw_fd(), libc::F_ADD_SEALS, seals) } < 0 {
            return Err(io::Error::last_os_error());
        }
        Ok(Self(Arc::new(file.into())))
    }

    /// That which the parent has made.
    pub(super) fn of(file: OwnedFd) -> Self {
        Self(Arc::new(file))
    }

    pub(super) fn file(&self) -> &OwnedFd {
        &self.0
    }

    /// The lane of this number.
    pub(super) fn lane(&self, number: usize) -> io::Result<Lane> {
        Lane::new(self, number * LANE_BYTES, INITIAL_LANE_BYTES)
    }
}

/// One lane, mapped, as one of the two processes sees it.
#[derive(Debug)]
pub(super) struct Lane {
    memory: Memory,
    offset: usize,
    bytes: usize,
    base: *mut u8,
}

// SAFETY: whose turn it is, and the lock of each lane, say who may use it.
unsafe impl Send for Lane {}
// SAFETY: shared by reference only its length is read, or atomics.
unsafe impl Sync for Lane {}

impl Drop for Lane {
    fn drop(&mut self) {
        // SAFETY: mapped by `new` with this length, and used no more.
        unsafe { libc::munmap(self.base.cast(), self.bytes) };
    }
}

impl Lane {
    fn new(memory: &Memory, offset: usize, bytes: usize) -> io::Result<Self> {
        let far = |_| io::Error::from(io::ErrorKind::OutOfMemory);
        let at = libc::off_t::try_from(offset).map_err(far)?;
        let access = libc::PROT_READ | libc::PROT_WRITE;
        // SAFETY: a new mapping of an open file.
        let base = unsafe {
            let file = memory.0.as_raw_fd();
            libc::mmap(ptr::null_mut(), bytes, access, libc::MAP_SHARED, file, at)
        };
        if base == libc::MAP_FAILED {
            return Err(io::Error::last_os_error());
        }
        Ok(Self { memory: memory.clone(), offset, bytes, base: base.cast() })
    }

    pub(super) fn head(&self) -> &Head {
        // SAFETY: a lane begins with it, on a page boundary, and all its bits are valid.
        unsafe { &*self.base.cast::<Head>() }
    }

    /// Makes room for so many bytes of data.
    ///
    /// # Errors
    /// If the system has no room.
    pub(super) fn room(&mut self, bytes: usize) -> io::Result<()> {
        let wanted = bytes.saturating_add(LANE_HEADER_BYTES).next_multiple_of(LANE_HEADER_BYTES);
        if wanted <= self.bytes {
            return Ok(());
        }
        if wanted > LANE_BYTES {
            return Err(io::ErrorKind::OutOfMemory.into());
        }
        *self = Self::new(&self.memory, self.offset, wanted.max(2 * self.bytes).min(LANE_BYTES))?;
        Ok(())
    }

    /// The data, of as many bytes as there was [`Lane::room`] made for.
    pub(super) fn data(&self) -> *mut u8 {
        // SAFETY: every lane is longer than a page.
        unsafe { self.base.add(LANE_HEADER_BYTES) }
    }

    /// Puts a text at the start of the data.
    ///
    /// # Errors
    /// As for [`Lane::room`].
    pub(super) fn write(&mut self, text: &str) -> io::Result<()> {
        self.write_behind(0, text)
    }

    /// Puts a text behind so many bytes of data.
    ///
    /// # Errors
    /// As for [`Lane::room`].
    pub(super) fn write_behind(&mut self, start: usize, text: &str) -> io::Result<()> {
        self.room(start.saturating_add(text.len()))?;
        // SAFETY: there is room.
        unsafe { ptr::copy_nonoverlapping(text.as_ptr(), self.data().add(start), text.len()) };
        self.head().text.store(text.len() as u64, Ordering::Relaxed);
        Ok(())
    }

    /// The text at the start of the data.
    ///
    /// # Errors
    /// As for [`Lane::room`].
    pub(super) fn read(&mut self) -> io::Result<String> {
        self.read_behind(0)
    }

    /// The text behind so many bytes of data.
    ///
    /// # Errors
    /// As for [`Lane::room`].
    pub(super) fn read_behind(&mut self, start: usize) -> io::Result<String> {
        let length =
            usize::try_from(self.head().text.load(Ordering::Relaxed)).unwrap_or(usize::MAX);
        self.room(start.saturating_add(length))?;
        let mut bytes = vec![0; length];
        // SAFETY: there is room, and the vector is of this length. A copy, as others may write there.
        unsafe { ptr::copy_nonoverlapping(self.data().add(start), bytes.as_mut_ptr(), length) };
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// Gives the lane to the other side.
    pub(super) fn hand_over(&self, turn: u32) {
        let head = self.head();
        head.turn.store(turn, Ordering::SeqCst);
        if head.asleep[waiter(turn)].load(Ordering::SeqCst) != 0 {
            // SAFETY: wakes those who sleep at this address, in any process.
            unsafe {
                libc::syscall(libc::SYS_futex, head.turn.as_ptr(), libc::FUTEX_WAKE, i32::MAX)
            };
        }
    }

    /// Waits until it is the turn that is wanted, for so long at most; whether it is.
    pub(super) fn wait_for(&self, wanted: u32, patience: Duration) -> bool {
        let (head, asleep) = (self.head(), &self.head().asleep[waiter(wanted)]);
        let come = || head.turn.load(Ordering::Acquire) == wanted;
        for look in 0..SPINS_BEFORE_YIELD + YIELDS_BEFORE_SLEEP {
            if come() {
                return true;
            }
            if look < SPINS_BEFORE_YIELD {
                std::hint::spin_loop()
            } else {
                std::thread::yield_now()
            }
        }
        let end = Instant::now() + patience;
        loop {
            asleep.store(1, Ordering::SeqCst);
            let turn = head.turn.load(Ordering::SeqCst);
            let left = end.saturating_duration_since(Instant::now());
            if turn == wanted || left.is_zero() {
                asleep.store(0, Ordering::SeqCst);
                return turn == wanted;
            }
            let left = libc::timespec {
                tv_sec: libc::time_t::try_from(left.as_secs()).unwrap_or(libc::time_t::MAX),
                tv_nsec: left.subsec_nanos().into(),
            };
            // SAFETY: sleeps while the turn is as read above, and no longer than is said.
            unsafe {
                libc::syscall(
                    libc::SYS_futex,
                    head.turn.as_ptr(),
                    libc::FUTEX_WAIT,
                    turn,
                    &raw const left,
                )
            };
            asleep.store(0, Ordering::SeqCst);
        }
    }
}
