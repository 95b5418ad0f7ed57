//! Programs made from the grammar itself (RAPID kernel reference, chapters 2 and 10): whatever it allows is read without an
//! opaque region, in any spelling and with any white space and comments between the words.

use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truegrind_programs::rapid::parser::{parse, parse_in_parts};

/// Writes one program.
struct Writer {
    random: ChaCha8Rng,
    text: Vec<u8>,
    /// How many more nested things may be opened.
    room: usize,
    /// Whether the last thing written was a word or number, which the next one must not touch.
    word: bool,
}

impl Writer {
    fn new(seed: u64) -> Self {
        Self { random: ChaCha8Rng::seed_from_u64(seed), text: Vec::new(), room: 40, word: false }
    }

    fn chance(&mut self, percent: u32) -> bool {
        self.random.random_ratio(percent, 100)
    }

    fn pick<T: Copy>(&mut self, list: &[T]) -> T {
        *list.choose(&mut self.random).unwrap()
    }

    /// White space and comments, or nothing where nothing is needed.
    fn gap(&mut self, needed: bool) {
        let blanks: [&[u8]; 8] = [b" ", b"  ", b"\t", b"\n", b"\r\n", b"\n\n   ", b" \x0c", b"\r\n\t"];
        if needed || self.chance(40) {
            let blank = self.pick(&blanks);
            self.text.extend_from_slice(blank);
        }
        if self.chance(4) {
            let comments: [&[u8]; 8] = [
                b"! MoveL p1,v100,z10,tool0;",
                b"!",
                b"!! \"not a string",
                b"! ENDPROC",
                b"! \xB2\xE2\xCA\xD4[{|\\",
                "! Schleifscheibe Ø 200, 打磨".as_bytes(),
                b"! %%% <SMT>",
                b"!! a := [1,2",
            ];
            let comment = self.pick(&comments);
            self.text.extend_from_slice(comment);
            self.text.extend_from_slice(if self.random.random() { b"\n" } else { b"\r\n" });
        }
    }

    /// A word or number.
    fn word(&mut self, word: &str) {
        let before = self.word;
        self.gap(before);
        // A gap may have been nothing but a comment, which ends with a line.
        self.text.extend_from_slice(word.as_bytes());
        self.word = true;
    }

    /// A reserved word, in any case.
    fn keyword(&mut self, word: &str) {
        let spelled = match self.random.random_range(0..4) {
            0 => word.to_ascii_lowercase(),
            1 => word[..1].to_owned() + &word[1..].to_ascii_lowercase(),
            _ => word.to_owned(),
        };
        self.word(&spelled);
    }

    fn sign(&mut self, sign: &str) {
        self.gap(false);
        self.text.extend_from_slice(sign.as_bytes());
        self.word = false;
    }

    fn name(&mut self) {
        let names = [
            "p10",
            "Target_10",
            "x",
            "nCount",
            "tool0",
            "wobj0",
            "v100",
            "fine",
            "reg1",
            "Grind",
            "a_b_c",
            "Stop",
            "Offs",
            "task",
            "TASK1",
            "switch",
            "VERSION",
            "E1",
            "d2",
            "e",
            "Ende",
            "TO_",
            "IFx",
            "ORx",
            "Xor1",
            "DIVx",
        ];
        if self.chance(5) {
            // Latin-1 letters.
            self.word("G");
            self.text.extend_from_slice(b"r\xFC\xDFe\xC0");
            return;
        }
        let name = self.pick(&names);
        self.word(name);
    }

    fn number(&mut self) {
        let numbers = [
            "0",
            "12",
            "12.",
            ".5",
            "1.5E-3",
            "2E6",
            "9E+09",
            "9e9",
            "0x1F",
            "0B101",
            "0o17",
            "0d12",
            "3.14159265",
            "1E9",
        ];
        let number = self.pick(&numbers);
        self.word(number);
    }

    fn string(&mut self) {
        let strings: [&[u8]; 9] = [
            b"\"\"",
            b"\"done\"",
            b"\"a \"\" b\"",
            b"\"! no comment; MODULE\"",
            b"\"\\0A\\0D\"",
            b"\"C:\\\\\"",
            b"\"HOME:/x.mod\"",
            b"\"\xE4\xF6\xFC [\"",
            b"\"\"\"\"",
        ];
        self.gap(false);
        let string = self.pick(&strings);
        self.text.extend_from_slice(string);
        self.word = false;
    }

    fn list(&mut self, least: usize, most: usize, each: fn(&mut Self)) {
        for index in 0..self.random.random_range(least..=most) {
            if index > 0 {
                self.sign(",");
            }
            each(self);
        }
    }

    // ---- expressions ----

    /// Runs `deeper` where there is room for it, `flat` elsewhere.
    fn within(&mut self, deeper: impl FnOnce(&mut Self), flat: impl FnOnce(&mut Self)) {
        if self.room == 0 {
            return flat(self);
        }
        self.room -= 1;
        deeper(self);
    }

    fn expression(&mut self) {
        if self.chance(12) {
            self.keyword("NOT");
        }
        self.within(
            |w| {
                w.term();
                while w.chance(25) {
                    match w.random.random_range(0..4) {
                        0 => {
                            let word = w.pick(&["AND", "OR", "XOR", "DIV", "MOD"]);
                            w.keyword(word);
                            if w.chance(20) {
                                w.keyword("NOT");
                            }
                        }
                        1 => {
                            let sign = w.pick(&["<", "<=", "=", ">", ">=", "<>"]);
                            w.sign(sign);
                            // `<x>` with one of the placeholders' names would be a placeholder.
                        }
                        _ => {
                            let sign = w.pick(&["+", "-", "*", "/"]);
                            w.sign(sign);
                        }
                    }
                    w.term();
                }
            },
            Self::number,
        );
    }

    fn term(&mut self) {
        if self.chance(15) {
            let sign = self.pick(&["-", "+"]);
            self.sign(sign);
        }
        match self.random.random_range(0..12) {
            0..=2 => self.number(),
            3 => self.string(),
            4 => {
                let word = self.pick(&["TRUE", "FALSE"]);
                self.keyword(word);
            }
            5 => self.within(
                |w| {
                    w.sign("[");
                    w.list(1, 4, Self::expression);
                    w.sign("]");
                },
                Self::name,
            ),
            6 => self.within(
                |w| {
                    w.sign("(");
                    w.expression();
                    w.sign(")");
                },
                Self::name,
            ),
            7 | 8 => self.within(
                |w| {
                    w.name();
                    w.sign("(");
                    w.arguments();
                    w.sign(")");
                },
                Self::name,
            ),
            9 => self.sign("<EXP>"),
            _ => self.place(),
        }
    }

    fn place(&mut self) {
        self.name();
        if self.chance(25) {
            self.sign("{");
            self.list(1, 3, Self::expression);
            self.sign("}");
        }
        for _ in 0..self.random.random_range(0..3) {
            self.sign(".");
            self.name();
        }
    }

    /// Required arguments by position or name, optional ones with or without a comma before them.
    fn arguments(&mut self) {
        let mut first = true;
        for _ in 0..self.random.random_range(0..5) {
            if self.chance(35) {
                if !first && self.chance(50) {
                    self.sign(",");
                }
                self.sign("\\");
                self.name();
                match self.random.random_range(0..5) {
                    0 => {}
                    1 => {
                        self.sign("?");
                        self.name();
                    }
                    _ => {
                        self.sign(":=");
                        self.expression();
                    }
                }
            } else {
                if !first {
                    self.sign(",");
                }
                if self.chance(8) {
                    self.name();
                    self.sign(":=");
                }
                self.expression();
            }
            first = false;
        }
    }

    // ---- statements ----

    fn statements(&mut self, most: usize) {
        for _ in 0..self.random.random_range(0..=most) {
            self.statement();
        }
    }

    fn simple(&mut self) {
        match self.random.random_range(0..10) {
            0 | 1 => {
                self.place();
                self.sign(":=");
                self.expression();
            }
            2..=5 => {
                self.name();
                // A name and a sign could be read as an expression's first words only where something else stood before.
                self.word = true;
                self.arguments();
            }
            6 => {
                self.sign("%");
                self.string();
                self.sign("%");
                self.word = true;
                self.arguments();
            }
            7 => {
                self.keyword("RETURN");
                if self.random.random() {
                    self.expression();
                }
            }
            8 => {
                let word = self.pick(&["EXIT", "RETRY", "TRYNEXT", "RAISE"]);
                self.keyword(word);
            }
            _ => {
                self.keyword("GOTO");
                self.name();
            }
        }
        self.sign(";");
    }

    fn statement(&mut self) {
        if self.room == 0 {
            return self.simple();
        }
        self.room -= 1;
        match self.random.random_range(0..13) {
            0 => {
                self.keyword("IF");
                self.expression();
                self.keyword("THEN");
                self.statements(3);
                for _ in 0..self.random.random_range(0..3) {
                    self.keyword("ELSEIF");
                    self.expression();
                    self.keyword("THEN");
                    self.statements(2);
                }
                if self.random.random() {
                    self.keyword("ELSE");
                    self.statements(2);
                }
                self.keyword("ENDIF");
            }
            1 => {
                // Without THEN: the condition ends where a name begins, so it must not end so that the name goes on with it.
                self.keyword("IF");
                self.name();
                self.sign("=");
                self.number();
                self.name();
                self.sign(":=");
                self.expression();
                self.sign(";");
            }
            2 => {
                self.keyword("FOR");
                self.name();
                self.keyword("FROM");
                self.expression();
                self.keyword("TO");
                self.expression();
                if self.random.random() {
                    self.keyword("STEP");
                    self.expression();
                }
                self.keyword("DO");
                self.statements(3);
                self.keyword("ENDFOR");
            }
            3 => {
                self.keyword("WHILE");
                self.expression();
                self.keyword("DO");
                self.statements(3);
                self.keyword("ENDWHILE");
            }
            4 => {
                self.keyword("TEST");
                self.expression();
                for _ in 0..self.random.random_range(0..3) {
                    self.keyword("CASE");
                    self.list(1, 3, Self::expression);
                    self.sign(":");
                    self.statements(2);
                }
                if self.random.random() {
                    self.keyword("DEFAULT");
                    self.sign(":");
                    self.statements(2);
                }
                self.keyword("ENDTEST");
            }
            5 => {
                self.name();
                self.sign(":");
            }
            6 => {
                self.keyword("CONNECT");
                self.place();
                self.keyword("WITH");
                self.name();
                self.sign(";");
            }
            7 => self.sign("<SMT>"),
            _ => self.simple(),
        }
    }

    // ---- declarations ----

    fn data(&mut self, in_routine: bool) {
        let shared = if in_routine { 2 } else { self.random.random_range(0..4) };
        match shared {
            0 => self.keyword("LOCAL"),
            1 => self.keyword("TASK"),
            _ => {}
        }
        let kind = match (in_routine, shared) {
            (true, _) => self.pick(&["VAR", "CONST"]),
            (_, 1) => self.pick(&["VAR", "PERS"]),
            _ => self.pick(&["VAR", "CONST", "PERS"]),
        };
        self.keyword(kind);
        self.name();
        self.name();
        if self.chance(30) {
            self.sign("{");
            self.list(1, 3, Self::expression);
            self.sign("}");
        }
        if self.chance(70) {
            self.sign(":=");
            self.expression();
        }
        self.sign(";");
    }

    fn parameter(&mut self) {
        let mode = self.pick(&["", "VAR", "PERS", "INOUT"]);
        if !mode.is_empty() {
            self.keyword(mode);
        }
        self.name();
        self.name();
        if self.chance(20) {
            self.sign("{*");
            while self.chance(30) {
                self.sign(",");
                self.sign("*");
            }
            self.sign("}");
        }
    }

    fn parameters(&mut self) {
        self.sign("(");
        let mut first = true;
        for _ in 0..self.random.random_range(0..4) {
            if self.chance(35) {
                if !first && self.random.random() {
                    self.sign(",");
                }
                self.sign("\\");
                loop {
                    if self.random.random() {
                        self.word("switch");
                        self.name();
                    } else {
                        self.parameter();
                    }
                    if !self.chance(30) {
                        break;
                    }
                    self.sign("|");
                }
            } else {
                if !first {
                    self.sign(",");
                }
                self.parameter();
            }
            first = false;
        }
        self.sign(")");
    }

    fn routine(&mut self) {
        self.room = 12;
        if self.chance(25) {
            self.keyword("LOCAL");
        }
        let kind = self.pick(&["PROC", "PROC", "FUNC", "TRAP"]);
        self.keyword(kind);
        if kind == "FUNC" {
            self.name();
        }
        self.name();
        if kind != "TRAP" {
            self.parameters();
        }
        for _ in 0..self.random.random_range(0..3) {
            self.data(true);
        }
        self.statements(6);
        if kind == "PROC" && self.chance(15) {
            self.keyword("BACKWARD");
            self.statements(2);
        }
        if self.chance(25) {
            self.keyword("ERROR");
            if self.chance(30) {
                self.sign("(");
                self.list(1, 2, Self::name);
                self.sign(")");
            }
            self.statements(2);
        }
        if self.chance(15) {
            self.keyword("UNDO");
            self.statements(2);
        }
        self.keyword(&format!("END{kind}"));
    }

    fn module(&mut self) {
        self.keyword("MODULE");
        self.name();
        if self.chance(30) {
            self.sign("(");
            let attributes = self.pick(&[
                &["SYSMODULE"][..],
                &["SYSMODULE", "NOVIEW"],
                &["NOSTEPIN", "VIEWONLY"],
                &["SYSMODULE", "NOSTEPIN", "READONLY"],
            ]);
            for (index, attribute) in attributes.iter().enumerate() {
                if index > 0 {
                    self.sign(",");
                }
                self.keyword(attribute);
            }
            self.sign(")");
        }
        for _ in 0..self.random.random_range(0..3) {
            if self.chance(30) {
                self.keyword("LOCAL");
            }
            if self.random.random() {
                self.keyword("RECORD");
                self.name();
                for _ in 0..self.random.random_range(1..4) {
                    self.name();
                    self.name();
                    self.sign(";");
                }
                self.keyword("ENDRECORD");
            } else {
                self.keyword("ALIAS");
                self.name();
                self.name();
                self.sign(";");
            }
        }
        for _ in 0..self.random.random_range(0..6) {
            self.room = 12;
            self.data(false);
        }
        for _ in 0..self.random.random_range(0..5) {
            self.routine();
        }
        self.keyword("ENDMODULE");
    }

    fn file(mut self) -> Vec<u8> {
        if self.chance(20) {
            self.text.extend_from_slice(b"\xEF\xBB\xBF");
        }
        if self.chance(20) {
            self.text.extend_from_slice(b"%%%\r\n  VERSION:1\r\n  LANGUAGE:ENGLISH\r\n%%%\r\n");
        }
        for _ in 0..self.random.random_range(1..3) {
            self.module();
        }
        if self.random.random() {
            self.gap(true);
        }
        self.text
    }
}

#[test]
fn whatever_the_grammar_allows_is_read() {
    for seed in 0..4000 {
        let source = Writer::new(seed).file();
        let tree = parse(&source);
        assert_eq!(tree.print(), source);
        if let Some(opaque) = tree.opaque.first() {
            let at = tree.start(opaque.at);
            let around = &source[at.saturating_sub(120)..(at + 60).min(source.len())];
            panic!("seed {seed}, {:?} at byte {at}: {}", opaque.reason, String::from_utf8_lossy(around));
        }
    }
}

#[test]
fn a_file_that_is_read_in_parts_has_the_same_tree() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    for seed in 0..600 {
        let mut source = Writer::new(seed).file();
        // Most of them broken somewhere.
        for _ in 0..random.random_range(0..4) {
            if source.is_empty() {
                break;
            }
            let at = random.random_range(0..source.len());
            let end = (at + random.random_range(1..30)).min(source.len());
            match random.random_range(0..3) {
                0 => drop(source.drain(at..end)),
                1 => {
                    let piece = source[at..end].to_vec();
                    let to = random.random_range(0..source.len());
                    drop(source.splice(to..to, piece));
                }
                _ => drop(source.splice(at..at, *b" ENDIF ")),
            }
        }
        let whole = parse_in_parts(&source, 1);
        for parts in [2, 3, 7, 30] {
            let other = parse_in_parts(&source, parts);
            assert_eq!(other.nodes, whole.nodes, "seed {seed}, {parts} parts");
            assert_eq!(other.opaque, whole.opaque, "seed {seed}, {parts} parts");
        }
    }
}
