//! YUV4MPEG2 (Y4M): uncompressed video with a line of text as its header, as ffmpeg and mjpegtools write it.
//!
//! ```text
//! YUV4MPEG2 W320 H240 F30:1 Ip A1:1 C420jpeg
//! FRAME
//! (320 x 240 bytes of luma, then the colours)
//! FRAME
//! ...
//! ```
//!
//! Parameters follow a space and begin with a letter, in any order: W and H in pixels, F frames a second, C the
//! colour space, I interlacing, A the shape of a pixel, X whatever else. What is not needed is passed over, on
//! the lines of frames too. An interlaced frame is taken as it stands, both fields in one. Written from
//! mjpegtools' manual page `yuv4mpeg(5)` and what ffmpeg writes.

mod reader;
mod writer;

pub use reader::Reader;
pub use writer::Writer;

use std::fmt;

use super::{FrameFault, Rate, checked_size};

/// What a stream begins with.
pub const MAGIC: &[u8] = b"YUV4MPEG2";

/// The longest line of text read; ffmpeg's own are below 100 bytes.
const MAX_LINE: u64 = 4096;

/// Which samples of colour there are, each of 8 bits, behind the luma.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Chroma {
    /// None: gray.
    Mono,
    /// Two, for every second pixel of every second row (`C420`, `C420jpeg`, `C420mpeg2`, `C420paldv`, which
    /// differ in where the sample is taken).
    C420,
    /// Two, for every fourth pixel of a row.
    C411,
    /// Two, for every second pixel of a row.
    C422,
    /// Two for every pixel.
    C444,
    /// Two for every pixel, and its opacity.
    C444Alpha,
}

impl Chroma {
    /// Every layout that is read.
    pub const ALL: [Chroma; 6] =
        [Chroma::Mono, Chroma::C420, Chroma::C411, Chroma::C422, Chroma::C444, Chroma::C444Alpha];

    /// By the parameter C without its letter, in capitals or not.
    fn from_name(name: &str) -> Option<Chroma> {
        Some(match name.to_ascii_lowercase().as_str() {
            "mono" => Chroma::Mono,
            "420" | "420jpeg" | "420mpeg2" | "420paldv" => Chroma::C420,
            "411" => Chroma::C411,
            "422" => Chroma::C422,
            "444" => Chroma::C444,
            "444alpha" => Chroma::C444Alpha,
            _ => return None,
        })
    }

    /// The parameter C without its letter.
    const fn name(self) -> &'static str {
        match self {
            Chroma::Mono => "mono",
            Chroma::C420 => "420jpeg",
            Chroma::C411 => "411",
            Chroma::C422 => "422",
            Chroma::C444 => "444",
            Chroma::C444Alpha => "444alpha",
        }
    }

    /// Pixels that share a sample of colour, across and down; none where there is no colour.
    const fn cell(self) -> Option<(u32, u32)> {
        match self {
            Chroma::Mono => None,
            Chroma::C420 => Some((2, 2)),
            Chroma::C411 => Some((4, 1)),
            Chroma::C422 => Some((2, 1)),
            Chroma::C444 | Chroma::C444Alpha => Some((1, 1)),
        }
    }

    /// Bytes behind the luma of a frame; odd sides are rounded up.
    fn bytes(self, width: u32, height: u32) -> u64 {
        let planes = if self == Chroma::C444Alpha { 3 } else { 2 };
        let samples = |(across, down)| u64::from(width.div_ceil(across)) * u64::from(height.div_ceil(down));
        self.cell().map_or(0, |cell| planes * samples(cell))
    }
}

/// What the first line of a stream says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Width of the frames in pixels.
    pub width: u32,
    /// Height of the frames in pixels.
    pub height: u32,
    /// Frames a second, if known.
    pub rate: Option<Rate>,
    /// The samples of colour.
    pub chroma: Chroma,
    /// Whether the luma is declared to go from 16 to 235 only, as in television, or from 0 to 255; none if nothing is
    /// said.
    pub limited: Option<bool>,
}

impl Header {
    /// Reads the first line, without its end.
    fn parse(line: &[u8]) -> Result<Header, FrameFault> {
        let text = String::from_utf8_lossy(line);
        let mut words = text.split_ascii_whitespace();
        if words.next().is_none_or(|word| word.as_bytes() != MAGIC) {
            return Err(FrameFault::NotY4m);
        }
        let (mut width, mut height, mut rate, mut space, mut old_space) = (None, None, None, None, None);
        let mut limited = None;
        for word in words {
            let mut letters = word.chars();
            let letter = letters.next();
            let value = letters.as_str();
            let number = || {
                let digits = !value.is_empty() && value.bytes().all(|b| b.is_ascii_digit());
                // Only a number beyond 64 bits fails to parse then.
                if digits { Ok(value.parse().unwrap_or(u64::MAX)) } else { Err(malformed(word)) }
            };
            match letter {
                Some('W') => width = Some(number()?),
                Some('H') => height = Some(number()?),
                Some('F') => {
                    let parts = value.split_once(':');
                    let parts = parts.and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
                    // 0:0 is how the format says that the rate is unknown.
                    rate = parts.map(|(a, b)| Rate::new(a, b)).ok_or_else(|| malformed(word))?;
                }
                Some('C') => space = Some(value.to_string()),
                // ffmpeg repeats the colour space here; old versions of it say it nowhere else.
                Some('X') => match value.split_once('=') {
                    Some(("YSCSS", value)) => old_space = Some(value.to_string()),
                    Some(("COLORRANGE", "LIMITED")) => limited = Some(true),
                    Some(("COLORRANGE", "FULL")) => limited = Some(false),
                    _ => {}
                },
                _ => {}
            }
        }
        let (Some(width), Some(height)) = (width, height) else {
            return Err(FrameFault::Header("gives no width (W) or no height (H)".to_string()));
        };
        let (width, height) = checked_size(width, height)?;
        // Without the parameter it is 4:2:0.
        let space = space.or(old_space).unwrap_or_else(|| "420".to_string());
        let chroma = Chroma::from_name(&space);
        let chroma = chroma.ok_or_else(|| FrameFault::ColourSpace(plain(space.as_bytes())))?;
        Ok(Header { width, height, rate, chroma, limited })
    }

    /// Bytes of a frame behind its line.
    fn frame_bytes(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height) + self.chroma.bytes(self.width, self.height)
    }
}

impl fmt::Display for Header {
    /// The first line of a stream, without its end: progressive, with square pixels.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Header { width, height, rate, chroma, limited } = self;
        let rate = rate.map_or("0:0".to_string(), |rate| rate.to_string());
        write!(f, "YUV4MPEG2 W{width} H{height} F{rate} Ip A1:1 C{}", chroma.name())?;
        match limited {
            Some(true) => f.write_str(" XCOLORRANGE=LIMITED"),
            Some(false) => f.write_str(" XCOLORRANGE=FULL"),
            None => Ok(()),
        }
    }
}

fn malformed(word: &str) -> FrameFault {
    FrameFault::Header(format!("has the parameter `{}`, which makes no sense", plain(word.as_bytes())))
}

/// The beginning of something read, fit for a message.
fn plain(bytes: &[u8]) -> String {
    bytes.iter().take(20).map(|&b| if b.is_ascii_graphic() { char::from(b) } else { '.' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(line: &str) -> Result<Header, String> {
        Header::parse(line.as_bytes()).map_err(|fault| fault.to_string())
    }

    #[test]
    fn headers_as_others_write_them() {
        // ffmpeg 5.1, -pix_fmt gray and yuv422p; an old one; mjpegtools; the least there can be.
        let header = parse("YUV4MPEG2 W65 H49 F30000:1001 Ip A1:1 Cmono XCOLORRANGE=FULL").expect("sound");
        assert_eq!((header.width, header.height, header.chroma), (65, 49, Chroma::Mono));
        assert_eq!((header.rate, header.limited), (Rate::new(30_000, 1001), Some(false)));
        let header =
            parse("YUV4MPEG2 W65 H49 F25:1 It A1:1 C422 XYSCSS=422 XCOLORRANGE=LIMITED").expect("sound");
        assert_eq!((header.chroma, header.limited), (Chroma::C422, Some(true)));
        let header = parse("YUV4MPEG2 W65 H49 F25:1 Ip A0:0 XYSCSS=411").expect("sound");
        assert_eq!(header.chroma, Chroma::C411);
        let header = parse("YUV4MPEG2 H288  W352 F0:0 Ib A59:54 C420paldv XMJPEGTOOLS ").expect("sound");
        assert_eq!((header.width, header.height, header.rate), (352, 288, None));
        assert_eq!(parse("YUV4MPEG2 W16 H16").expect("sound").chroma, Chroma::C420);
        // In capitals, and with the end of a line as Windows writes it.
        for (space, chroma) in [
            ("CMONO", Chroma::Mono),
            ("C420JPEG", Chroma::C420),
            ("C444Alpha", Chroma::C444Alpha),
            ("XYSCSS=420PALDV", Chroma::C420),
            ("Cmono\r", Chroma::Mono),
        ] {
            assert_eq!(parse(&format!("YUV4MPEG2 W16 H16 {space}")).expect(space).chroma, chroma);
        }
    }

    #[test]
    fn headers_round_trip() {
        for chroma in Chroma::ALL {
            for (rate, limited) in
                [(None, None), (Rate::new(25, 2), Some(true)), (Rate::new(30, 1), Some(false))]
            {
                let header = Header { width: 33, height: 17, rate, chroma, limited };
                assert_eq!(parse(&header.to_string()), Ok(header));
            }
        }
    }

    #[test]
    fn refusals_say_what_to_do() {
        for (line, said) in [
            ("", "YUV4MPEG2"),
            ("YUV4MPEG3 W320 H240", "YUV4MPEG2"),
            ("RIFF W320 H240", "-f yuv4mpegpipe"),
            ("YUV4MPEG2 W320", "no height"),
            ("YUV4MPEG2 W H240", "`W`"),
            ("YUV4MPEG2 W-320 H240", "`W-320`"),
            ("YUV4MPEG2 W320 H240 F30", "`F30`"),
            ("YUV4MPEG2 W320 H240 C420p10 XYSCSS=420P10", "C420p10"),
            ("YUV4MPEG2 W320 H240 C420p10", "-pix_fmt yuv420p"),
            ("YUV4MPEG2 W320 H240 Cmono16", "-pix_fmt gray"),
            ("YUV4MPEG2 W320 H240 C", "-pix_fmt gray"),
            ("YUV4MPEG2 W8 H240", "8x240"),
            ("YUV4MPEG2 W60000 H60000", "scale="),
            ("YUV4MPEG2 W99999999999999999999999999 H240", "pixels"),
        ] {
            let error = parse(line).expect_err(line);
            assert!(error.contains(said), "{line}: {error}");
        }
    }

    #[test]
    fn odd_sides_are_rounded_up() {
        let bytes = Chroma::ALL.map(|chroma| chroma.bytes(17, 19));
        assert_eq!(bytes, [0, 2 * 9 * 10, 2 * 5 * 19, 2 * 9 * 19, 2 * 17 * 19, 3 * 17 * 19]);
    }
}
