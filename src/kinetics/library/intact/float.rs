//! How the processor does floating-point arithmetic: rounding, traps, subnormal numbers.

/// The control registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Float(registers::Registers);

impl Float {
    pub(super) fn now() -> Self {
        Self(registers::now())
    }

    /// Puts back what has changed since, and says what that is.
    pub(super) fn restore(self) -> Option<String> {
        let found = registers::now();
        if found == self.0 {
            return None;
        }
        registers::set(self.0);
        let what = registers::changed(self.0, found).join(", ");
        Some(format!("leaves floating-point arithmetic changed ({what})"))
    }
}

#[cfg(target_arch = "x86_64")]
mod registers {
    use std::arch::asm;

    /// Control bits of MXCSR, and the control word of the older unit.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub(super) struct Registers {
        mxcsr: u32,
        word: u16,
    }

    /// All but the flags of what has happened.
    const CONTROL: u32 = 0xffc0;

    pub(super) fn now() -> Registers {
        let (mut mxcsr, mut word) = (0_u32, 0_u16);
        // SAFETY: both store a register to the place that is given.
        unsafe {
            asm!("stmxcsr [{}]", in(reg) &raw mut mxcsr, options(nostack, preserves_flags));
            asm!("fnstcw [{}]", in(reg) &raw mut word, options(nostack, preserves_flags));
        }
        Registers { mxcsr: mxcsr & CONTROL, word }
    }

    pub(super) fn set(registers: Registers) {
        // SAFETY: values that were there before; pending exceptions of the older unit are dropped first.
        unsafe {
            asm!("ldmxcsr [{}]", in(reg) &raw const registers.mxcsr, options(nostack, preserves_flags));
            asm!("fnclex", "fldcw [{}]", in(reg) &raw const registers.word,
                options(nostack, preserves_flags));
        }
    }

    pub(super) fn changed(before: Registers, after: Registers) -> Vec<&'static str> {
        let bits = before.mxcsr ^ after.mxcsr;
        let word = before.word ^ after.word;
        let rounding = bits & 0x6000 != 0 || word & 0x0c00 != 0;
        let traps = bits & 0x1f80 != 0 || word & 0x003f != 0;
        let kinds = [
            (rounding, "rounding"),
            (traps, "traps"),
            (bits & 0x8040 != 0, "subnormal numbers are taken for 0: -ffast-math?"),
            (word & 0x0300 != 0, "precision"),
        ];
        kinds.into_iter().filter(|kind| kind.0).map(|kind| kind.1).collect()
    }
}

#[cfg(target_arch = "aarch64")]
mod registers {
    use std::arch::asm;

    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub(super) struct Registers(u64);

    pub(super) fn now() -> Registers {
        let fpcr: u64;
        // SAFETY: reads a register.
        unsafe { asm!("mrs {}, fpcr", out(reg) fpcr, options(nomem, nostack, preserves_flags)) };
        Registers(fpcr)
    }

    pub(super) fn set(registers: Registers) {
        // SAFETY: a value that was there before.
        unsafe {
            asm!("msr fpcr, {}", in(reg) registers.0, options(nomem, nostack, preserves_flags))
        };
    }

    pub(super) fn changed(before: Registers, after: Registers) -> Vec<&'static str> {
        let bits = before.0 ^ after.0;
        let kinds = [
            (bits & (3 << 22) != 0, "rounding"),
            (bits & 0x9f00 != 0, "traps"),
            (bits & (1 << 24) != 0, "subnormal numbers are taken for 0: -ffast-math?"),
        ];
        kinds.into_iter().filter(|kind| kind.0).map(|kind| kind.1).collect()
    }
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
mod registers {
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub(super) struct Registers;

    pub(super) fn now() -> Registers {
        Registers
    }

    pub(super) fn set(_: Registers) {}

    pub(super) fn changed(_: Registers, _: Registers) -> Vec<&'static str> {
        Vec::new()
    }
}
