//! Routines that programs call.

use super::Maker;

impl Maker<'_> {
    /// All routines: those of the list, with random bodies where a gap is left.
    pub(super) fn routines(&mut self) -> String {
        let mut out = String::new();
        let motion = |maker: &mut Self| {
            let mut text = String::new();
            maker.motion(&mut text);
            text
        };
        let (a, b, c) = (self.pair(), self.pair(), self.pair());
        let (tool_a, object_a) = self.names(a);
        let (tool_b, object_b) = self.names(b);
        let (first, second) = (motion(self), motion(self));
        out.push_str(&format!(
            "PROC pMove(robtarget t,num up\\num side\\switch back)\nMoveL Offs(t,0,0,up),v100,z5,{tool_a}\\WObj:={object_a};\n\
             IF Present(side) THEN\nMoveL Offs(t,side,0,up),v50,fine,{tool_a}\\WObj:={object_a};\nENDIF\nIF Present(back) \
             {first}ENDPROC\n"
        ));
        out.push_str("PROC pShift(INOUT robtarget t,num k)\nt.trans.x:=t.trans.x+k;\nIF k>3 t.trans:=t.trans+[0,0,1];\nENDPROC\n");
        out.push_str(&format!(
            "PROC pMany(robtarget list{{*}})\nVAR num k:=0;\nFOR i FROM 1 TO Dim(list,1) DO\nk:=k+1;\nMoveL \
             list{{k}},v200,z1,{tool_b}\\WObj:={object_b};\nENDFOR\nENDPROC\n"
        ));
        out.push_str(
            "PROC pTool(PERS tooldata t,PERS wobjdata w,robtarget p)\nMoveJ p,v500,z10,t\\WObj:=w;\nMoveL \
             RelTool(p,0,0,-5),v100,fine,t\\WObj:=w;\nENDPROC\n",
        );
        out.push_str(&format!(
            "PROC pErr(num k)\nIF k>1 THEN\nTPWrite \"too much\";\nRAISE 1;\nENDIF\n{second}ERROR\nRAISE;\nENDPROC\n"
        ));
        let value = self.target(c);
        let (tool_c, object_c) = self.names(c);
        out.push_str(&format!(
            "PROC pSafe(num k)\nVAR num tries:=k;\nVAR robtarget t:={value};\npErr tries;\nMoveL \
             t,v100,z5,{tool_c}\\WObj:={object_c};\nERROR\nt.trans.z:=t.trans.z+2;\nIF tries>2 THEN\ntries:=1;\nRETRY;\nENDIF\n\
             IF tries>1 TRYNEXT;\nENDPROC\n"
        ));
        for k in 1..=2 {
            let body = motion(self);
            out.push_str(&format!("PROC pLate{k}()\nn1:=n1+{k};\n{body}ENDPROC\n"));
        }
        out.push_str(
            "FUNC robtarget fUp(robtarget t,num k)\nIF k<0 RETURN t;\nRETURN Offs(t,0,0,k);\nENDFUNC\n",
        );
        out.push_str("FUNC num fLift()\nRETURN 2.5;\nENDFUNC\nFUNC num fTwice(num k)\nVAR num r;\nr:=k;\nWHILE r<2*k DO\nr:=r+1;\nENDWHILE\nRETURN r;\nENDFUNC\n");
        out.push_str("FUNC robtarget fCount(robtarget t)\nn2:=n2+1;\nRETURN t;\nENDFUNC\n");
        out.push_str("FUNC num fNext(INOUT num k)\nk:=k+1;\nRETURN 3;\nENDFUNC\n");
        out.push_str("FUNC num fSay()\nTPWrite \"lift\"\\Num:=n1;\nRETURN 4;\nENDFUNC\n");
        out.push_str("FUNC robtarget fPick(robtarget t,num unused)\nRETURN t;\nENDFUNC\n");
        out.push_str("FUNC num fNote(num k)\nn2:=k;\nRETURN k;\nENDFUNC\n");
        out.push_str("FUNC num fMoves()\npv1.trans.z:=pv1.trans.z+1.5;\nRETURN 1;\nENDFUNC\n");
        out.push_str("FUNC bool fTest(num k)\nRETURN k>2 OR (NOT b1 AND k MOD 2=1);\nENDFUNC\n");
        out.push_str(
            "TRAP trAdd\nn2:=n2+1;\npv2.trans.x:=pv2.trans.x+0.5;\nIF n2 MOD 3=0 b1:=NOT b1;\nENDTRAP\n",
        );
        if self.features.wrapped {
            self.wrappers(&mut out);
        }
        out
    }

    /// Routines whose only statement is a motion on their parameters, or a call of such a routine.
    fn wrappers(&mut self, out: &mut String) {
        out.push_str(
            "PROC wLine(robtarget goal,speeddata v,zonedata z,PERS tooldata t\\PERS wobjdata w)\nMoveL goal,v,z,t\\WObj?w;\nENDPROC\n\
             LOCAL PROC wJoint(robtarget goal,speeddata v,zonedata z,PERS tooldata t,PERS wobjdata w)\nMoveJ \
             goal,v,z,t\\WObj:=w;\nENDPROC\n\
             PROC wArc(robtarget via,robtarget goal,speeddata v,zonedata z,PERS tooldata t,PERS wobjdata w)\nMoveC \
             via,goal,v,z,t\\WObj:=w;\nENDPROC\n\
             PROC wDeep(robtarget goal,PERS tooldata t\\PERS wobjdata w)\nwLine goal,v200,z5,t\\w?w;\nENDPROC\n",
        );
        let (tool, object) = self.names(self.pairs[1]);
        out.push_str(&format!(
            "PROC wHere(num unused,robtarget goal)\nMoveL goal,v50,fine,{tool}\\WObj:={object};\nENDPROC\n"
        ));
        let body = "MoveL goal,v,z,t\\WObj:=w;\nENDPROC\n";
        out.push_str(&format!(
            "PROC wKeep(robtarget goal,speeddata v,zonedata z,PERS tooldata t,PERS wobjdata w)\nVAR num k;\n{body}"
        ));
    }
}
