package Lookup "a table as libraries for version 3.2 have it, with functions of their own"
  partial model Table
    Real u;
    Real y;
    parameter Boolean tableOnFile = false;
    parameter Real table[:, 2] = [0, 1] annotation(Dialog(enable = not tableOnFile));
    parameter String tableName = "NoName";
    parameter String fileName = "NoName";
    final parameter Boolean verboseRead = true;
    final parameter Integer columns[:] = 2:size(table, 2);
    final parameter Modelica.Blocks.Types.Smoothness smoothness = Modelica.Blocks.Types.Smoothness.LinearSegments;
  protected
    Modelica.Blocks.Types.ExternalCombiTable1D tableID = Modelica.Blocks.Types.ExternalCombiTable1D(
      if tableOnFile then tableName else "NoName",
      if tableOnFile and fileName <> "NoName" and not Modelica.Utilities.Strings.isEmpty(fileName) then fileName else "NoName",
      table, columns, smoothness);
    Real tableOnFileRead(fixed = false);
    function readTableData
      extends Modelica.Icons.Function;
      input Modelica.Blocks.Types.ExternalCombiTable1D tableID;
      input Boolean forceRead = false;
      input Boolean verboseRead;
      output Real readSuccess;
      external "C" readSuccess = ModelicaStandardTables_CombiTable1D_read(tableID, forceRead, verboseRead)
        annotation(Library = {"ModelicaStandardTables"});
    end readTableData;
    function getTableValue
      extends Modelica.Icons.Function;
      input Modelica.Blocks.Types.ExternalCombiTable1D tableID;
      input Integer icol;
      input Real u;
      input Real tableAvailable "orders the calls" annotation(__OpenModelica_UnusedVariable = true);
      output Real y;
      external "C" y = ModelicaStandardTables_CombiTable1D_getValue(tableID, icol, u);
      annotation(derivative(noDerivative = tableAvailable) = getDerTableValue);
    end getTableValue;
    function getDerTableValue
      input Modelica.Blocks.Types.ExternalCombiTable1D tableID;
      input Integer icol;
      input Real u;
      input Real tableAvailable;
      input Real der_u;
      output Real der_y;
      external "C" der_y = ModelicaStandardTables_CombiTable1D_getDerValue(tableID, icol, u, der_u);
    end getDerTableValue;
  equation
    when initial() then
      if tableOnFile then
        tableOnFileRead = readTableData(tableID, false, verboseRead);
      else
        tableOnFileRead = 1.;
      end if;
    end when;
    if tableOnFile then
      assert(tableName <> "NoName", "tableOnFile = true and no table name given");
    else
      assert(size(table, 1) > 0 and size(table, 2) > 0, "the table is empty");
    end if;
    y = getTableValue(tableID, 1, u, tableOnFileRead);
  end Table;
  model Test
    model Mine
      extends Table(table = [0, 0; 1, 3; 2, 4]);
      parameter Real power = 1;
    equation
      u = time^power;
    end Mine;
    Mine t;
    Mine s(power = 2);
  end Test;
end Lookup;
