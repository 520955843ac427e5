//! Image files of every format, and files that are none.

use std::path::{Path, PathBuf};

use image::{DynamicImage, GrayImage, ImageFormat, Luma, Rgb, RgbImage, Rgba};
use tempfile::TempDir;
use vsonar::vision::{ImageError, ImageHeader, load, load_gray, to_gray};

/// A smooth picture, so that lossy formats keep it.
fn gray() -> GrayImage {
    GrayImage::from_fn(40, 24, |x, y| Luma([(x * 4 + y * 3) as u8]))
}

fn colour() -> RgbImage {
    RgbImage::from_fn(40, 24, |x, y| Rgb([(x * 6) as u8, (y * 10) as u8, (200 - x * 2 - y * 2) as u8]))
}

fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn write(folder: &TempDir, name: &str, content: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, content).expect("writable");
    path
}

fn largest_difference(a: &GrayImage, b: &GrayImage) -> u8 {
    assert_eq!(a.dimensions(), b.dimensions());
    a.pixels().zip(b.pixels()).map(|(a, b)| a.0[0].abs_diff(b.0[0])).max().expect("not empty")
}

#[test]
fn every_format_that_can_be_written_is_read() {
    let folder = folder();
    // The format, its extension, whether it stores gray as such, and how much its coding may change a value.
    let formats = [
        (ImageFormat::Png, "png", true, 0),
        (ImageFormat::Bmp, "bmp", true, 0),
        (ImageFormat::Tga, "tga", true, 0),
        (ImageFormat::Tiff, "tiff", true, 0),
        (ImageFormat::Pnm, "pnm", true, 0),
        (ImageFormat::WebP, "webp", true, 0),
        (ImageFormat::Ico, "ico", false, 0),
        (ImageFormat::Jpeg, "jpg", true, 6),
        (ImageFormat::Gif, "gif", false, 0),
        (ImageFormat::Qoi, "qoi", false, 0),
        (ImageFormat::Farbfeld, "ff", false, 0),
        (ImageFormat::Hdr, "hdr", false, 2),
        (ImageFormat::OpenExr, "exr", false, 0),
    ];
    for (format, extension, stores_gray, tolerance) in formats {
        let mut pictures = vec![DynamicImage::ImageRgb8(colour())];
        if stores_gray {
            pictures.push(DynamicImage::ImageLuma8(gray()));
        } else {
            pictures.push(DynamicImage::ImageRgb8(DynamicImage::ImageLuma8(gray()).to_rgb8()));
        }
        for picture in pictures {
            let mut picture = picture;
            if format == ImageFormat::Gif {
                // A palette holds 256 colours.
                let mut rgb = picture.to_rgb8();
                rgb.pixels_mut().for_each(|p| p.0 = p.0.map(|v| v & 0xc0));
                picture = DynamicImage::ImageRgb8(rgb);
            }
            let expected = to_gray(picture.clone());
            let picture = match format {
                ImageFormat::Gif | ImageFormat::Ico => DynamicImage::ImageRgba8(picture.to_rgba8()),
                ImageFormat::Farbfeld => DynamicImage::ImageRgba16(picture.to_rgba16()),
                ImageFormat::Hdr | ImageFormat::OpenExr => DynamicImage::ImageRgb32F(picture.to_rgb32f()),
                _ => picture,
            };
            let path = folder.path().join(format!("picture.{extension}"));
            picture.save_with_format(&path, format).unwrap_or_else(|e| panic!("{extension}: {e}"));
            let loaded = load_gray(&path).unwrap_or_else(|e| panic!("{e}"));
            let difference = largest_difference(&loaded, &expected);
            assert!(difference <= tolerance, "{extension}: off by {difference}");
        }
    }
}

#[test]
fn a_compressed_texture_is_read() {
    // A DDS file of 16 x 16 pixels: 16 DXT1 blocks whose pixels all take the first colour, pure green or white.
    let mut file = b"DDS ".to_vec();
    let mut header = [0u32; 31];
    (header[0], header[1], header[2], header[3], header[4]) = (124, 0x81007, 16, 16, 128);
    (header[18], header[19], header[26]) = (32, 4, 0x1000);
    header[20] = u32::from_le_bytes(*b"DXT1");
    header.iter().for_each(|word| file.extend(word.to_le_bytes()));
    for block in 0..16 {
        let colour: u16 = if block < 8 { 0x07e0 } else { 0xffff };
        file.extend(colour.to_le_bytes());
        file.extend([0; 6]);
    }
    let folder = folder();
    let image = load_gray(&write(&folder, "texture.dds", &file)).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(image.dimensions(), (16, 16));
    assert!(image.enumerate_pixels().all(|(_, y, p)| p.0[0] == if y < 8 { 150 } else { 255 }), "{image:?}");
}

#[test]
fn colour_is_weighted_and_alpha_ignored() {
    let gray = to_gray(DynamicImage::ImageRgb8(colour()));
    for (x, y, pixel) in gray.enumerate_pixels() {
        assert_eq!(pixel.0[0], luma(colour().get_pixel(x, y).0), "({x}, {y})");
    }
    let rgba = image::RgbaImage::from_fn(40, 24, |x, y| {
        let [r, g, b] = colour().get_pixel(x, y).0;
        Rgba([r, g, b, (x * y) as u8])
    });
    assert_eq!(to_gray(DynamicImage::ImageRgba8(rgba)), gray);
}

#[test]
fn sixteen_bits_scale_to_the_nearest_eight() {
    let folder = folder();
    let deep = image::ImageBuffer::<Luma<u16>, _>::from_fn(256, 256, |x, y| Luma([(y * 256 + x) as u16]));
    let expected = |v: u16| (f64::from(v) * 255.0 / 65535.0).round() as u8;
    for extension in ["png", "tiff", "pgm"] {
        let path = folder.path().join(format!("deep.{extension}"));
        deep.save(&path).unwrap_or_else(|e| panic!("{extension}: {e}"));
        let image = load_gray(&path).unwrap_or_else(|e| panic!("{e}"));
        for (x, y, pixel) in image.enumerate_pixels() {
            assert_eq!(pixel.0[0], expected(deep.get_pixel(x, y).0[0]), "{extension} ({x}, {y})");
        }
    }
    let deep = DynamicImage::ImageLuma16(deep);
    let wanted = to_gray(deep.clone());
    assert_eq!(to_gray(DynamicImage::ImageLumaA16(deep.to_luma_alpha16())), wanted);
    // Colour is brought to 8 bits first, so that a picture is the same with 16 bits.
    let rgb = image::ImageBuffer::<Rgb<u16>, _>::from_fn(64, 64, |x, y| {
        Rgb([(x * 1000) as u16, (y * 1000) as u16, (x * y * 16) as u16])
    });
    let image = to_gray(DynamicImage::ImageRgb16(rgb.clone()));
    for (x, y, pixel) in image.enumerate_pixels() {
        assert_eq!(pixel.0[0], luma(rgb.get_pixel(x, y).0.map(expected)), "({x}, {y})");
    }
    let rgb = DynamicImage::ImageRgb16(rgb);
    let deepened = RgbImage::from_fn(256, 64, |x, y| Rgb([x as u8, (x * y) as u8, (3 * y) as u8]));
    let deepened = DynamicImage::ImageRgb8(deepened);
    assert_eq!(to_gray(DynamicImage::ImageRgb16(deepened.to_rgb16())), to_gray(deepened));
    assert_eq!(to_gray(DynamicImage::ImageRgba16(rgb.to_rgba16())), image);
}

/// The gray of a colour by the weights of BT.601: 0.299, 0.587 and 0.114 of 65536.
fn luma([red, green, blue]: [u8; 3]) -> u8 {
    let sum = 19_595 * u32::from(red) + 38_470 * u32::from(green) + 7_471 * u32::from(blue);
    u8::try_from((sum + 32_768) / 65_536).expect("at most 255")
}

#[test]
fn weights_are_those_of_cameras() {
    for (colour, gray) in [
        ([255, 0, 0], 76),
        ([0, 255, 0], 150),
        ([0, 0, 255], 29),
        ([255, 255, 0], 226),
        ([0, 255, 255], 179),
        ([255, 0, 255], 105),
        ([180, 40, 40], 82),
        ([255, 255, 255], 255),
        ([0, 0, 0], 0),
        ([1, 0, 0], 0),
        ([2, 0, 0], 1),
    ] {
        let image = RgbImage::from_pixel(16, 16, Rgb(colour));
        assert_eq!(to_gray(DynamicImage::ImageRgb8(image)).get_pixel(3, 4).0, [gray], "{colour:?}");
    }
}

#[test]
fn gray_stays_what_it_is_however_it_is_stored() {
    let levels = GrayImage::from_fn(256, 16, |x, _| Luma([x as u8]));
    let gray = DynamicImage::ImageLuma8(levels.clone());
    for image in [
        DynamicImage::ImageLumaA8(gray.to_luma_alpha8()),
        DynamicImage::ImageRgb8(gray.to_rgb8()),
        DynamicImage::ImageRgba8(gray.to_rgba8()),
        DynamicImage::ImageLuma16(gray.to_luma16()),
        DynamicImage::ImageLumaA16(gray.to_luma_alpha16()),
        DynamicImage::ImageRgb16(gray.to_rgb16()),
        DynamicImage::ImageRgba16(gray.to_rgba16()),
        DynamicImage::ImageRgb32F(gray.to_rgb32f()),
        DynamicImage::ImageRgba32F(gray.to_rgba32f()),
    ] {
        assert_eq!(to_gray(image.clone()), levels, "{:?}", image.color());
    }
    let folder = folder();
    let path = folder.path().join("gray.png");
    DynamicImage::ImageRgb8(gray.to_rgb8()).save(&path).expect("writable");
    let (header, image) = (ImageHeader::read(&path).expect("sound"), load(&path).expect("sound"));
    assert!(header.stores_colour && !image.has_colour);
    DynamicImage::ImageRgb8(colour()).save(&path).expect("writable");
    assert!(load(&path).expect("sound").has_colour);
}

/// Red as PNG, and as JPEG from another program with half as many samples of colour.
#[test]
fn a_jpeg_gives_its_own_luma() {
    let red = |name: &str| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/regressions/gray-weights").join(name);
        load(&path).unwrap_or_else(|e| panic!("{e}"))
    };
    let (png, jpeg) = (red("red.png"), red("red.jpg"));
    assert!(png.has_colour && jpeg.has_colour);
    assert!(png.pixels.pixels().chain(jpeg.pixels.pixels()).all(|pixel| pixel.0 == [76]));
    // Of another picture, a rounding to RGB and back is not in the way; sides that blocks do not divide, too.
    let folder = folder();
    for (width, height) in [(40, 24), (33, 17), (16, 16)] {
        let picture = RgbImage::from_fn(width, height, |x, y| Rgb([(x * 6) as u8, 90, (y * 10) as u8]));
        let path = folder.path().join("colour.jpg");
        DynamicImage::ImageRgb8(picture.clone()).save(&path).expect("writable");
        let loaded = load(&path).expect("sound");
        assert!(loaded.has_colour);
        let difference = largest_difference(&loaded.pixels, &to_gray(DynamicImage::ImageRgb8(picture)));
        assert!(difference <= 8, "off by {difference}");
        let gray = GrayImage::from_fn(width, height, |x, y| Luma([(x * 4 + y * 3) as u8]));
        for stored in
            [DynamicImage::ImageLuma8(gray.clone()), DynamicImage::ImageLuma8(gray.clone()).to_rgb8().into()]
        {
            stored.save(&path).expect("writable");
            let loaded = load(&path).expect("sound");
            assert!(!loaded.has_colour && largest_difference(&loaded.pixels, &gray) <= 6);
        }
    }
}

#[test]
fn strange_floats_do_no_harm() {
    let values = [0.0, -1.0, 0.5, 1.0, 7.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    let image = image::Rgb32FImage::from_fn(16, 16, |x, y| Rgb([values[(x as usize + y as usize) % 8]; 3]));
    let gray = to_gray(DynamicImage::ImageRgb32F(image));
    let row: Vec<u8> = (0..5).map(|x| gray.get_pixel(x, 0).0[0]).collect();
    assert_eq!(row, [0, 0, 128, 255, 255]);
}

/// What loading says, with the file's name checked and taken away.
fn message(path: &Path) -> (ImageError, String) {
    let error = load_gray(path).expect_err("not a usable image");
    let text = error.to_string();
    let name = path.display().to_string();
    let rest = text.strip_prefix(&name).unwrap_or_else(|| panic!("the file is not named: {text}"));
    (error, rest.to_owned())
}

#[test]
fn unusable_files_are_named_with_a_remedy() {
    let folder = folder();
    let mut png = Vec::new();
    let picture = DynamicImage::ImageLuma8(gray());
    picture.write_to(&mut std::io::Cursor::new(&mut png), ImageFormat::Png).expect("in memory");

    let (error, text) = message(&folder.path().join("missing.png"));
    assert!(matches!(error, ImageError::Io { .. }), "{text}");
    assert!(text.contains("check the path"), "{text}");

    let (error, text) = message(folder.path());
    assert!(matches!(error, ImageError::Io { .. }), "{text}");

    for length in [0, 5, 8, 20, 40, png.len() / 2, png.len() - 20] {
        let (error, text) = message(&write(&folder, &format!("cut-{length}.png"), &png[..length]));
        assert!(matches!(error, ImageError::Decode { .. }), "{length} bytes: {text}");
        assert!(text.contains("get it again"), "{text}");
    }

    let (error, text) = message(&write(&folder, "text.png", b"image,x,y\nno.png,1,2\n"));
    assert!(matches!(error, ImageError::Decode { .. }), "{text}");
    for name in ["text", "text.txt"] {
        let (error, text) = message(&write(&folder, name, b"just some text\n"));
        assert!(matches!(error, ImageError::Format { .. }), "{text}");
        assert!(text.contains("convert it to PNG"), "{text}");
    }

    // The content counts, not the name.
    assert_eq!(load_gray(&write(&folder, "png.jpg", &png)).expect("a PNG"), gray());
    assert_eq!(load_gray(&write(&folder, "png", &png)).expect("a PNG"), gray());
}

/// A baseline JPEG file.
fn jpeg() -> Vec<u8> {
    let mut file = Vec::new();
    let picture = DynamicImage::ImageRgb8(colour());
    picture.write_to(&mut std::io::Cursor::new(&mut file), ImageFormat::Jpeg).expect("in memory");
    file
}

/// A progressive JPEG file of 64 x 64 pixels, by hand: a scan for the averages of its 64 blocks, tables, and a
/// scan for their other coefficients.
fn progressive() -> Vec<u8> {
    let mut file = vec![0xff, 0xd8];
    let mut segment = |code: u8, content: &[u8], data: &[u8]| {
        file.extend([0xff, code]);
        file.extend((content.len() as u16 + 2).to_be_bytes());
        file.extend(content);
        file.extend(data);
    };
    // The codes 0 and 10 for two symbols.
    let table = |class: u8, symbols: [u8; 2]| {
        let mut table = vec![class, 1, 1];
        table.extend([0; 14]);
        table.extend(symbols);
        table
    };
    segment(0xdb, &[&[0][..], &[8; 64]].concat(), &[]);
    segment(0xc2, &[8, 0, 64, 0, 64, 1, 1, 0x11, 0], &[]);
    segment(0xc4, &table(0x00, [0, 6]), &[]);
    // The first block is 63 above the middle (10 111111), the others are equal to it (0 each).
    segment(0xda, &[1, 1, 0, 0, 0, 0], &[0xbf, 0, 0, 0, 0, 0, 0, 0, 0x01]);
    segment(0xc4, &table(0x10, [0x00, 0x01]), &[]);
    // Each block has the first coefficient 1 (10 1) and no other (0).
    segment(0xda, &[1, 1, 0, 1, 63, 0], &[0xaa; 32]);
    file.extend([0xff, 0xd9]);
    file
}

/// Bytes without order.
fn junk(length: usize) -> Vec<u8> {
    let mut state = 7u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    (0..length).map(|_| next()).collect()
}

#[test]
fn a_jpeg_is_whole_up_to_its_own_end() {
    let folder = folder();
    for (name, whole) in [("baseline", jpeg()), ("progressive", progressive())] {
        let path = write(&folder, "whole.jpg", &whole);
        let expected = load_gray(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
        // Phones append films, other programs what they like: with a start of a scan, with another picture.
        let film = [b"\0\0\0\x18ftypmp42", &junk(5000)[..], &[0xff, 0xda, 0, 8, 1]].concat();
        for trailer in [b"trailer".to_vec(), film, vec![0xff, 0xda], whole.clone(), whole[..99].to_vec()] {
            let path = write(&folder, "trailer.jpg", &[&whole[..], &trailer].concat());
            let loaded = load_gray(&path).unwrap_or_else(|e| panic!("{name}, {trailer:x?}: {e}"));
            assert_eq!(loaded, expected, "{name}");
        }
    }
    // The gray of the progressive one is as its data say: the middle and 63, of 8 steps each, by 8 for the average.
    let gray = load_gray(&write(&folder, "p.jpg", &progressive())).expect("a whole JPEG");
    assert_eq!(gray.dimensions(), (64, 64));
    assert!(gray.pixels().all(|p| p.0[0].abs_diff(128 + 63) <= 2), "{gray:?}");
    // Fill bytes before the end marker.
    let whole = jpeg();
    let filled = [&whole[..whole.len() - 2], &[0xff, 0xff, 0xff, 0xd9]].concat();
    load_gray(&write(&folder, "filled.jpg", &filled)).expect("a whole JPEG");
}

#[test]
fn a_jpeg_that_is_cut_off_is_refused() {
    let folder = folder();
    // Neither an error nor a half-gray picture may be taken for the image.
    let refused = |content: &[u8], what: &dyn std::fmt::Display| {
        let (error, text) = message(&write(&folder, "cut.jpg", content));
        let expected = matches!(error, ImageError::Decode { .. } | ImageError::CutOff { .. });
        assert!(expected, "{what}: {text}");
    };
    for (name, whole) in [("baseline", jpeg()), ("progressive", progressive())] {
        for length in 0..whole.len() {
            refused(&whole[..length], &format!("{name}, {length} bytes"));
        }
    }
    // Cut within the data, and an end marker further on all the same.
    let end: &[u8] = &[0xff, 0xd9];
    let whole = jpeg();
    let data = whole.windows(2).rposition(|pair| pair == [0xff, 0xda]).expect("a scan") + 14;
    let third = (whole.len() - data) / 3;
    for length in [data + third, data + 2 * third] {
        for tail in [&b""[..], b"and then some text", &junk(3000), &whole] {
            let what = format!("{length} bytes and {} others", tail.len());
            refused(&[&whole[..length], tail, end].concat(), &what);
        }
    }
    let whole = progressive();
    refused(&[&whole[..whole.len() - 12], end].concat(), &"progressive, in the second scan");
}

#[test]
fn sizes_are_limited() {
    let folder = folder();
    for (width, height, usable) in [(16, 16, true), (15, 16, false), (16, 15, false), (1, 1, false)] {
        let path = folder.path().join(format!("{width}x{height}.png"));
        GrayImage::new(width, height).save(&path).expect("writable");
        if usable {
            assert_eq!(load_gray(&path).expect("just large enough").dimensions(), (width, height));
            continue;
        }
        let (error, text) = message(&path);
        assert!(matches!(error, ImageError::TooSmall { .. }), "{text}");
        assert!(text.contains(&format!("{width}x{height}")) && text.contains("16x16"), "{text}");
    }
    // Tiny files that claim to be enormous.
    for (width, height) in [(70_000u32, 16u32), (16, 70_000), (60_000, 60_000)] {
        let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
        let mut chunk = |kind: &[u8], data: &[u8]| {
            let body = [kind, data].concat();
            file.extend((data.len() as u32).to_be_bytes());
            file.extend(&body);
            file.extend(crc32fast::hash(&body).to_be_bytes());
        };
        chunk(b"IHDR", &[&width.to_be_bytes()[..], &height.to_be_bytes()[..], &[8, 0, 0, 0, 0]].concat());
        chunk(b"IDAT", &[0x78, 0x9c, 0x03, 0, 0, 0, 0, 1]);
        chunk(b"IEND", &[]);
        let (error, text) = message(&write(&folder, "bomb.png", &file));
        assert!(matches!(error, ImageError::TooLarge { .. }), "{text}");
        assert!(text.contains(&format!("{width}x{height}")) && text.contains("scale"), "{text}");
    }
}
