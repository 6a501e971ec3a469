
model A
  Real u = 0.5; 
  Real k2, w0, p, q, D, z[2];
  Real x1(start=0), x2(start=0);
  parameter Real w = 2*3.14159265358979;
initial equation
  der(x1) = 0; der(x2) = 0;
equation
  k2 = 1; z[1] = u;
  p = cos(3.14159265/2 + 3.14159265/2*0.5);
  q = sin(3.14159265/2 + 3.14159265/2*0.5);
  w0 = (p^2 + q^2)*w;
  D = -p/w0*w;
  der(x1) = x2;
  der(x2) = k2*w0^2*z[1] - 2*D*w0*x2 - w0^2*x1;
  z[2] = x1;
end A;
