//! The supported G codes by dialect. A code that is missing here makes the whole modal state unknown.
//!
//! Codes are in tenths: 540 for G54, 434 for G43.4.

use super::super::dialect::Dialect;

/// The kinds of word in a block, for codes whose meaning depends on them.
#[derive(Debug, Clone, Copy)]
pub(super) struct WordKinds {
    /// X, Y, Z, A, B, C and the like.
    pub(super) axes: bool,
    /// I, J, K.
    pub(super) centre: bool,
}

/// Whether a G code is supported in this dialect, in a block with these words.
pub(super) fn is_g(code: u32, dialect: Dialect, word_kinds: WordKinds) -> bool {
    match code {
        0 | 10 | 20 | 30 | 40 | 90 | 170 | 180 | 190 | 330 | 400 | 410 | 420 | 530 => true,
        540 | 550 | 560 | 570 | 640 | 900 | 910 | 930 | 940 | 950 | 960 | 970 => true,
        _ => match dialect {
            Dialect::Siemens => siemens(code),
            Dialect::LinuxCnc => linux_cnc(code),
            Dialect::Fanuc => fanuc(code, word_kinds),
            Dialect::Iso => {
                // G5 with a centre is a spline of LinuxCNC; alone it is a mode switch of Fanuc.
                let either = !matches!(code, 50 | 51) || word_kinds.centre || !word_kinds.axes;
                (fanuc(code, word_kinds) || linux_cnc(code)) && either
            }
            // Heidenhain conversational has no G codes.
            Dialect::Heidenhain => false,
        },
    }
}

fn fanuc(code: u32, word_kinds: WordKinds) -> bool {
    match code {
        // High speed, smoothing: no motion, and axis words only name axes.
        50 | 51 => true,
        // Look-ahead.
        80 => !word_kinds.axes,
        22..=24 | 32..=34 | 62 | 71 | 100 | 110 | 120 | 121 | 130 | 131 => true,
        150 | 160 | 200 | 210 | 220 | 230 | 250 | 260 | 270 | 280 | 281 | 290 | 300 | 301 | 310..=318 => true,
        320 | 340 | 350 | 360 | 370 | 412..=416 | 422..=426 | 430 | 431 | 434 | 435 | 440 | 490 => true,
        // G50 with axes sets the origin of a lathe.
        500 => !word_kinds.axes,
        501 | 510 | 511 | 520 | 531 | 536 | 541 | 542 | 544 | 580 | 590 | 600 | 610 | 611 | 620 | 630 => true,
        650 | 660 | 661 | 670 | 680..=690 | 700..=790 | 800..=899 | 901 | 911 | 920 | 921 | 922 | 923 => true,
        980 | 990 | 1000 | 1010 | 1030 | 1070 | 1120 | 1130 | 1360 | 1500 | 1530 | 1550 => true,
        1540 | 1610..=1690 | 1740 | 1840 | 1870 | 2340 | 2540 | 2550 | 2680 | 2690 => true,
        // Engraving.
        470 => true,
        _ => false,
    }
}

const LINUX_CNC: &[u32] = &[
    50, 51, 52, 53, 70, 80, 100, 150, 160, 200, 210, 280, 281, 300, 301, 331, 411, 421, 430, 431, 432, 434,
    435, 440, 490, 500, 501, 510, 511, 520, 541, 580, 590, 591, 592, 593, 610, 611, 700, 710, 720, 730, 740,
    760, 800, 901, 911, 980, 990,
];

fn linux_cnc(code: u32) -> bool {
    LINUX_CNC.contains(&code) || matches!(code, 382..=385 | 680..=690 | 810..=890 | 920..=923)
}

const SIEMENS: &[u32] = &[
    250, 260, 340, 350, 450, 580, 590, 600, 620, 630, 700, 710, 740, 750, 1100, 1110, 1120, 1470, 1480, 1530,
    2470, 2480, 3310, 3320, 3350, 3360, 3400, 3410, 3470, 3480, 4500, 4510, 5000, 6210, 7000, 7100, 9610,
    9620, 9710, 9720, 9730,
];

fn siemens(code: u32) -> bool {
    SIEMENS.contains(&code)
        || matches!(code, 1400..=1430 | 4600..=4620 | 5050..=5990 | 6010..=6030 | 6410..=6450)
}
