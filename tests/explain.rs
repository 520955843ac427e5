//! Listings of random individuals: the printed text, read back and run by itself, gives the answers of the walker of
//! trees, bit for bit.

mod common;

use vsonar::explain::Listing;
use vsonar::ir::generate::Random as Small;
use vsonar::lower::lower;

#[test]
fn a_printed_listing_computes_what_the_tree_does() {
    let walker = common::executors().remove(0);
    let (mut choices, mut stops, mut names, mut answers, mut not_le) = (0, 0, 0, 0, 0);
    for batch in 0..24u64 {
        let (width, height) = [(16, 16), (40, 24), (64, 48), (33, 57)][batch as usize % 4];
        let mut random = Small::new(77 + batch);
        let images: Vec<_> = (0..5).map(|_| common::image(&mut random, width, height)).collect();
        let lanes: Vec<_> = (0..21).map(|i| (i % 5, random.below(width as usize) as u32)).collect();
        let cases = common::case_set(&images, &lanes);
        for individual in common::individuals(900 + batch, 300) {
            let program = vsonar::ir::opt::optimise(&lower(&individual, width, height));
            let text = Listing::of(&program).expect("no bit patterns").to_string();
            let listing: Listing = text.parse().unwrap_or_else(|e| panic!("{e}\n{text}\n{individual}"));
            assert_eq!(listing.to_string(), text, "{individual}");
            let judged = common::answers(walker.as_ref(), &individual, &cases);
            for (i, lane) in cases.lanes().iter().enumerate() {
                let found = listing.answer(cases.image(i), lane.column as f32);
                assert!(
                    common::same(judged[i], found),
                    "batch {batch}, case {i}: {found:e} instead of {:e}\n{individual}\n{program}\n{text}",
                    judged[i]
                );
                answers += 1;
            }
            choices += text.matches("if ").count();
            stops += text.matches("stop").count();
            names += text.matches("let ").count();
            not_le += text.matches('≰').count();
        }
    }
    println!("{answers} answers, {choices} choices, {stops} stops, {names} names, {not_le} ≰");
    assert!(choices > 1000 && stops > 100 && names > 500 && not_le > 0, "the sample says little");
}
