//! Floating-point environment of a thread: rounding, traps, subnormal numbers.

/// Control registers of the processor, one beside the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FloatingPoint(u64);

impl FloatingPoint {
    pub(super) fn now() -> Self {
        Self(registers::now())
    }

    /// Restores the registers; says what has changed.
    pub(super) fn restore(self) -> Option<String> {
        let changed = self.0 ^ registers::now();
        if changed == 0 {
            return None;
        }
        registers::set(self.0);
        let kinds = registers::CONTROL_BITS.iter().filter(|(bits, _)| changed & bits != 0);
        let kinds: Vec<&str> = kinds.map(|(_, kind)| *kind).collect();
        Some(format!("leaves floating-point arithmetic changed ({})", kinds.join(", ")))
    }
}

#[cfg(target_arch = "x86_64")]
mod registers {
    use std::arch::asm;

    /// Control bits of MXCSR, and from bit 32 on the control word of the x87 unit.
    pub(super) const CONTROL_BITS: [(u64, &str); 4] = [
        (0x0c00_0000_6000, "rounding"),
        (0x003f_0000_1f80, "traps"),
        (0x8040, "subnormal numbers are taken for 0: -ffast-math?"),
        (0x0300_0000_0000, "precision"),
    ];

    /// All of MXCSR but the flags of what has happened.
    const CONTROL_MASK: u32 = 0xffc0;

    pub(super) fn now() -> u64 {
        let (mut mxcsr, mut word) = (0_u32, 0_u16);
        // SAFETY: both store a register to the place that is given.
        unsafe {
            asm!("stmxcsr [{}]", in(reg) &raw mut mxcsr, options(nostack, preserves_flags));
            asm!("fnstcw [{}]", in(reg) &raw mut word, options(nostack, preserves_flags));
        }
        u64::from(mxcsr & CONTROL_MASK) | u64::from(word) << 32
    }

    pub(super) fn set(registers: u64) {
        // Little-endian: MXCSR comes first, the control word after 4 bytes.
        let both = [registers];
        let place = both.as_ptr().cast::<u8>();
        // SAFETY: values that were there before; pending exceptions of the x87 unit are dropped first.
        unsafe {
            asm!("ldmxcsr [{}]", in(reg) place, options(nostack, preserves_flags));
            asm!("fnclex", "fldcw [{} + 4]", in(reg) place, options(nostack, preserves_flags));
        }
    }
}

#[cfg(target_arch = "aarch64")]
mod registers {
    use std::arch::asm;

    /// Control bits of FPCR.
    pub(super) const CONTROL_BITS: [(u64, &str); 3] = [
        (3 << 22, "rounding"),
        (0x9f00, "traps"),
        (1 << 24, "subnormal numbers are taken for 0: -ffast-math?"),
    ];

    pub(super) fn now() -> u64 {
        let fpcr: u64;
        // SAFETY: reads a register.
        unsafe { asm!("mrs {}, fpcr", out(reg) fpcr, options(nomem, nostack, preserves_flags)) };
        fpcr
    }

    pub(super) fn set(fpcr: u64) {
        // SAFETY: a value that was there before.
        unsafe { asm!("msr fpcr, {}", in(reg) fpcr, options(nomem, nostack, preserves_flags)) };
    }
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
mod registers {
    pub(super) const CONTROL_BITS: [(u64, &str); 0] = [];

    pub(super) fn now() -> u64 {
        0
    }

    pub(super) fn set(_: u64) {}
}
