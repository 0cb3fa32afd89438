use std::time::Instant;
use tetdb::{mesh::Mesh, optimize, pipeline, samples::SampleSpec, sizing::SizeField, store::Pager, surface::{self, Surface}};
fn main() {
    let arg = std::env::args().nth(1).unwrap();
    let opt = std::env::args().nth(2).unwrap_or("full".into());
    let hsiz = std::env::args().nth(3);
    let t = Instant::now();
    let surface: Surface = if arg.starts_with("sample:") { SampleSpec::parse(&arg).unwrap().make().unwrap().into() } else { tetdb::io::read::read_surface(&[arg.into()]).unwrap() };
    println!("surface {} triangles {:.2}s", surface.triangles.len(), t.elapsed().as_secs_f64());
    let t = Instant::now();
    let v = surface::validate(&surface);
    println!("valid {:?} {:.2}s", v.accept().is_ok(), t.elapsed().as_secs_f64());
    let t = Instant::now();
    let options = pipeline::Options { optimize: Some(opt), hsiz, ..Default::default() };
    let field = SizeField::build(&surface.points, &surface.triangles, &options.sizes().unwrap()).unwrap();
    println!("field {} leaves {:.2}s", field.n_leaves(), t.elapsed().as_secs_f64());
    let mut mesh = Mesh::new(Pager::new(10 << 30, None));
    let t = Instant::now();
    let r = pipeline::coarse(&mut mesh, &surface, &options, &pipeline::silent).unwrap();
    println!("coarse {} tets {:.2}s {:?}", mesh.n_tets(), t.elapsed().as_secs_f64(), r.recovery);
    println!("regions {:?}", r.regions.list.len());
    let t = Instant::now();
    let last = std::cell::RefCell::new((String::new(), Instant::now()));
    let f = pipeline::fine(&mut mesh, &field, surface.bounds(), &options, &|e: pipeline::Event| {
        let mut l = last.borrow_mut();
        if l.0 != e.stage { println!("  {} -> {:.2}s", l.0, l.1.elapsed().as_secs_f64()); *l = (e.stage.to_owned(), Instant::now()); }
    }).unwrap();
    { let l = last.borrow(); println!("  {} -> {:.2}s", l.0, l.1.elapsed().as_secs_f64()); }
    println!("fine {:.2}s {:#?}", t.elapsed().as_secs_f64(), f);
    let q = optimize::measure(&mut mesh);
    println!("{q:#?}");
}
