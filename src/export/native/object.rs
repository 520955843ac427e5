//! An object file with a detector's functions.

use cranelift_codegen::ir::{Endianness, Function};
use cranelift_module::{DataDescription, DataId, Linkage, Module};
use cranelift_object::{ObjectBuilder, ObjectModule};

use super::module::Definer;
use super::{NativeError, Target, sensor};
use crate::camera::ground::Ground;
use crate::exec::cranelift::Effort;
use crate::export::{ABI, Request, header};

/// A finished object file.
#[derive(Debug, Clone)]
pub struct Object {
    /// The file.
    pub bytes: Vec<u8>,
    /// Bytes of stack that a call of any of its functions takes at most.
    pub stack: usize,
}

impl Object {
    /// Compiles what is asked for.
    ///
    /// # Errors
    /// If the code generator refuses the target or the program, or would call a library.
    pub fn compile(request: &Request, target: &Target) -> Result<Object, NativeError> {
        let isa = target.isa(Effort::once(&request.program), false)?;
        let name = request.symbol.as_str();
        // A call of a library is an error before its name matters.
        let builder =
            ObjectBuilder::new(isa.clone(), format!("{name}.c"), cranelift_module::default_libcall_names())?;
        let mut module = ObjectModule::new(builder);
        let info = info_data(&mut module, request)?;
        let mut definer = Definer::new(&mut module, isa.clone());
        let isa = &*isa;
        let rows = definer.rows(name, &request.program, target.shape())?;
        let mut stack = rows.stack;
        let mut export = |definer: &mut Definer<'_, ObjectModule>,
                          suffix: &str,
                          deepest: usize,
                          build: &dyn Fn(&mut ObjectModule, &mut _, &mut Function)|
         -> Result<(), NativeError> {
            let defined = definer.define(&format!("{name}_{suffix}"), Linkage::Export, deepest, build)?;
            stack = stack.max(defined.stack);
            Ok(())
        };
        export(&mut definer, "detect", rows.stack, &|module, context, function| {
            sensor::detect(isa, context, function, |function| module.declare_func_in_func(rows.id, function));
        })?;
        if let Some(camera) = &request.camera {
            let ground = Ground::new(camera, request.program.width(), request.program.height());
            export(&mut definer, "ranges", rows.stack, &|module, context, function| {
                sensor::ranges(isa, context, function, &ground, request.median, |function| {
                    module.declare_func_in_func(rows.id, function)
                });
            })?;
            export(&mut definer, "reset", 0, &|_, context, function| {
                sensor::reset(isa, context, function, request.median);
            })?;
        }
        export(&mut definer, "info", 0, &|module, context, function| {
            sensor::info(isa, context, function, |function| module.declare_data_in_func(info, function));
        })?;
        let product = module.finish();
        let bytes = product.emit().map_err(|e| NativeError::Compile(e.to_string()))?;
        Ok(Object { bytes, stack })
    }
}

/// The constant that `NAME_info` gives: whole numbers, then addresses of texts.
fn info_data(module: &mut ObjectModule, request: &Request) -> Result<DataId, NativeError> {
    let (name, provenance, program) = (request.symbol.as_str(), &request.provenance, &request.program);
    let little = module.isa().endianness() == Endianness::Little;
    let (correct, cases) = provenance.answers();
    let numbers = [
        ABI,
        program.width().cast_signed(),
        program.height().cast_signed(),
        header::median(request).cast_signed(),
        i32::from(request.camera.is_some()),
        correct,
        cases,
        i32::from(provenance.seed.is_some()),
    ];
    let number = |n: i32| if little { n.to_le_bytes() } else { n.to_be_bytes() };
    let mut bytes: Vec<u8> = numbers.iter().flat_map(|&n| number(n)).collect();
    let seed = provenance.seed.unwrap_or(0);
    bytes.extend(if little { seed.to_le_bytes() } else { seed.to_be_bytes() });
    let texts = [
        env!("CARGO_PKG_VERSION"),
        name,
        provenance.data.as_deref().unwrap_or(""),
        provenance.program.as_str(),
    ];
    let addresses = bytes.len();
    bytes.extend([0; 8 * 4]);

    let mut info = DataDescription::new();
    info.define(bytes.into_boxed_slice());
    info.set_align(8);
    for (number, text) in texts.into_iter().enumerate() {
        // A text of C ends at its first zero byte.
        let mut text: Vec<u8> = text.bytes().filter(|&byte| byte != 0).collect();
        text.push(0);
        let mut data = DataDescription::new();
        data.define(text.into_boxed_slice());
        let id = module.declare_data(&format!("{name}_text{number}"), Linkage::Local, false, false)?;
        module.define_data(id, &data)?;
        let reference = module.declare_data_in_data(id, &mut info);
        info.write_data_addr((addresses + 8 * number) as u32, reference, 0);
    }
    let id = module.declare_data(&format!("{name}_info_data"), Linkage::Local, false, false)?;
    module.define_data(id, &info)?;
    Ok(id)
}
